//! One triangle in one tile: which samples it covers, and at what depth.
//!
//! The edge functions of the contract are 64-bit integers in subpixels. Seen from a tile they fit 32 bits: values at
//! neighbouring pixel centres differ by multiples of 256, so dividing by 256 and rounding down changes no sign; an edge
//! with the whole tile inside is left out, and for any other one the value at a pixel of the tile is at most
//! 31 * (2^23 + 2^23) from zero.

use pellucid_core::pixel_grid::{ScreenTriangle, center, depth_at};

use crate::bin::{PixelRect, TILE_PX};

/// An edge seen from a tile: not negative inside.
#[derive(Clone, Copy, Default)]
struct TileEdge {
    /// Change for one pixel to the right.
    dx: i32,
    /// Change for one pixel downwards.
    dy: i32,
    /// Value at the tile's top left pixel.
    value: i32,
}

/// Calls `cover` with the index in the tile (row by row, [`TILE_PX`] apart), the pixel's column and row in the picture
/// and the depth, for each sample of the tile that the triangle covers.
#[inline]
pub(crate) fn rasterize(
    triangle: &ScreenTriangle,
    samples: PixelRect,
    tile: PixelRect,
    mut cover: impl FnMut(usize, i32, i32, f32),
) {
    let mut edges = [TileEdge::default(); 3];
    for (tile_edge, edge) in edges.iter_mut().zip(&triangle.edges) {
        let value = edge.biased_at(center(tile.left), center(tile.top)) >> 8;
        let (across, down) = (edge.a * i64::from(TILE_PX - 1), edge.b * i64::from(TILE_PX - 1));
        if value + across.max(0) + down.max(0) < 0 {
            return;
        }
        if value + across.min(0) + down.min(0) < 0 {
            *tile_edge = TileEdge { dx: edge.a as i32, dy: edge.b as i32, value: value as i32 };
        }
    }
    let left = samples.left.max(tile.left);
    let right = samples.right.min(tile.right);
    let top = samples.top.max(tile.top);
    let bottom = samples.bottom.min(tile.bottom);
    let depth_plane = triangle.depth_plane(triangle.weight_planes());
    let depth_range = triangle.depth_range();
    let [anchor_x, anchor_y] = triangle.anchor_px();
    for y in top..=bottom {
        let row = (y - tile.top) as usize * TILE_PX as usize;
        let mut values = edges.map(|edge| edge.value + edge.dx * (left - tile.left) + edge.dy * (y - tile.top));
        for x in left..=right {
            if values[0] | values[1] | values[2] >= 0 {
                let depth = depth_at(&depth_plane, depth_range, x - anchor_x, y - anchor_y);
                cover(row + (x - tile.left) as usize, x, y, depth);
            }
            for (value, edge) in values.iter_mut().zip(&edges) {
                *value = value.wrapping_add(edge.dx);
            }
        }
    }
}
