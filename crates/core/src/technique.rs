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
}

impl Technique {
    /// All there are.
    pub const ALL: [Self; 2] = [Self::Cpu, Self::Oracle];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Oracle => "oracle",
        }
    }

    /// The backend it runs on.
    pub fn backend(self) -> &'static str {
        match self {
            Self::Cpu | Self::Oracle => "cpu",
        }
    }

    /// Whether it captures every fragment and orders all of them.
    pub fn is_exact(self) -> bool {
        match self {
            Self::Cpu | Self::Oracle => true,
        }
    }

    /// Passes over the geometry.
    pub fn passes(self) -> &'static str {
        match self {
            Self::Cpu | Self::Oracle => "1",
        }
    }

    /// Bytes it holds besides scene and picture, as a formula.
    pub fn memory_formula(self) -> &'static str {
        match self {
            Self::Cpu => "16 B x vertices + 96 B x visible triangles + threads x fragments of a tile x 24 B",
            Self::Oracle => "24 B x fragments",
        }
    }

    /// One line on how it works.
    pub fn description(self) -> &'static str {
        match self {
            Self::Cpu => "bins triangles into tiles, captures, sorts and resolves tile by tile on all cores",
            Self::Oracle => "tests every triangle against every pixel; slow, the reference of all others",
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
