//! The techniques: how fragments are captured and ordered.

use std::fmt;
use std::str::FromStr;

use crate::Error;

/// A way to capture and order fragments. What becomes of them is a [`Resolve`](crate::Resolve)'s affair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Technique {
    /// Tile by tile on all cores.
    Cpu,
    /// Every triangle against every pixel: slow, obvious, the gold standard.
    Oracle,
    /// Unsorted hardware blending in draw order: wrong on purpose.
    Alpha,
    /// Depth peeling: front to back, one layer a pass (Everitt 2001).
    Peel,
    /// Linearized layered fragment buffer (LFB chapter, section 20.4).
    Linear,
    /// Linked list of fragments for each pixel (LFB chapter, section 20.3).
    List,
    /// As much room for every pixel as the deepest needs (Crassin 2010).
    ABuffer,
    /// Linked pages of fragments for each pixel (Crassin 2010, follow-up; LFB chapter, section 20.2).
    Pages,
    /// A slot for every fragment in rasterization order, sorted into blending order (Houston, Preetham and Segal 2005).
    FBuffer,
    /// A rasterizer in compute shaders: covered parts of blocks sorted by depth, then a filter for each pixel, and pixels
    /// where that was not enough once more (LucidRaster, Jakubowski 2025).
    Lucid,
}

impl Technique {
    /// All there are.
    pub const ALL: [Self; 10] = [
        Self::Cpu,
        Self::Oracle,
        Self::Alpha,
        Self::Peel,
        Self::Linear,
        Self::List,
        Self::ABuffer,
        Self::Pages,
        Self::FBuffer,
        Self::Lucid,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Oracle => "oracle",
            Self::Alpha => "alpha",
            Self::Peel => "peel",
            Self::Linear => "linear",
            Self::List => "list",
            Self::ABuffer => "abuffer",
            Self::Pages => "pages",
            Self::FBuffer => "fbuffer",
            Self::Lucid => "lucid",
        }
    }

    /// The backend it runs on.
    pub fn backend(self) -> &'static str {
        match self {
            Self::Cpu | Self::Oracle => "cpu",
            Self::Alpha
            | Self::Peel
            | Self::Linear
            | Self::List
            | Self::ABuffer
            | Self::Pages
            | Self::FBuffer
            | Self::Lucid => "gpu",
        }
    }

    /// Whether it captures every fragment and orders all of them.
    pub fn is_exact(self) -> bool {
        match self {
            Self::Cpu
            | Self::Oracle
            | Self::Peel
            | Self::Linear
            | Self::List
            | Self::ABuffer
            | Self::Pages
            | Self::FBuffer
            | Self::Lucid => true,
            Self::Alpha => false,
        }
    }

    /// Passes over the geometry.
    pub fn passes(self) -> &'static str {
        match self {
            Self::Cpu | Self::Oracle | Self::Alpha | Self::List | Self::ABuffer | Self::Pages | Self::Lucid => "1",
            Self::Peel => "layers + 1",
            Self::Linear => "2",
            Self::FBuffer => "windows",
        }
    }

    /// Bytes it holds besides scene and picture, as a formula.
    pub fn memory_formula(self) -> &'static str {
        match self {
            Self::Cpu => {
                "16 B x vertices + 18 B x small fragments + 104 B x larger triangles + threads x fragments of a tile x 28 B"
            }
            Self::Oracle => "32 B x fragments",
            Self::Alpha => "8 B x pixels",
            Self::Peel => "44 B x pixels, 60 B for gelly and blend:corrected",
            Self::Linear => "5.75 B x pixels + 16 B (20 B if a pixel has more than 32) x fragments",
            Self::List => "9.75 B x pixels + 20 B (24 B if a pixel has more than 32) x fragments",
            Self::ABuffer => {
                "5.75 B x pixels + 16 B (20 B in textures, if it is above 32) x pixels x greatest depth complexity"
            }
            Self::Pages => "9.75 B x pixels + 68 B x pages of 4 fragments",
            Self::FBuffer => {
                "9.75 B x pixels + 80 B x triangles + 20 B x their rows + 28 B (40 B merged) x fragments + 32 B x slots"
            }
            Self::Lucid => {
                "22.1 B x pixels + 80 B x visible triangles + 81 B x their parts in blocks of 8 x 8 pixels + 16 B (20 B if a pixel is repaired) x fragments"
            }
        }
    }

    /// One line on how it works.
    pub fn description(self) -> &'static str {
        match self {
            Self::Cpu => "bins triangles into tiles, captures, sorts and resolves tile by tile on all cores",
            Self::Oracle => "tests every triangle against every pixel; slow, the reference of all others",
            Self::Alpha => "blends in draw order without sorting; wrong on purpose, a yardstick",
            Self::Peel => "draws the scene once for each layer, front to back, and blends layers under each other",
            Self::Linear => "counts fragments, allocates exactly as much, captures and sorts pixel by pixel",
            Self::List => "links the fragments of each pixel, in one pass; repeats it if there was too little room",
            Self::ABuffer => "captures into arrays, one for each pixel, all as long; repeats it if they were too short",
            Self::FBuffer => {
                "gives every fragment a slot in rasterization order, then sorts them all into blending order"
            }
            Self::Lucid => {
                "rasterizes in compute, sorts parts of triangles block by block, and pixels where that was not enough"
            }
            Self::Pages => {
                "links pages of fragments of each pixel, in one pass; repeats it if there was too little room"
            }
        }
    }
}

impl fmt::Display for Technique {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Technique {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|technique| technique.name() == name).ok_or_else(|| Error::UnknownName {
            kind: "technique",
            name: name.to_owned(),
            known: Self::ALL.map(Self::name).join(", "),
        })
    }
}
