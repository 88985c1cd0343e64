//! Thin glass with pits, in three passes: what figure 3 of the F-Buffer paper shows. Twin, which runs on the GPU: the passes
//! of the example `pitted_glass` of `pellucid-gpu`.
//!
//! Everything is computed in the mesh's own space, in which the eye is where the last row of the clip matrix vanishes; so
//! instances may be placed as they like.

use glam::{Vec3, Vec4};
use pellucid_core::primitive::Draw;
use pellucid_cpu::fbuffer::{Fragment, Program, Verdict};

/// Passes of the shader.
pub const PASSES: u64 = 3;

/// What passes hand on: three targets.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Slot {
    /// Normal with bumps, turned to the eye; and how deep a pit is.
    normal: Vec4,
    /// Light from behind, through the glass, and its share.
    pub(super) refracted: Vec4,
    /// Light from in front, and its share.
    reflected: Vec4,
}

pub(super) fn program() -> Program<'static, Slot> {
    Program::new(|_, slot: &Slot| Some(show(slot))).pass(bump).pass(refract)
}

/// Pass 1: the normal of a surface with pits.
fn bump(fragment: &Fragment<'_>, slot: &mut Slot) -> Verdict {
    let position = position(fragment);
    let normal = normal(fragment);
    let depth_at = |offset: Vec3| pit(position + offset);
    const STEP: f32 = 0.01;
    let depth = depth_at(Vec3::ZERO);
    let slope = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| (depth_at(axis * STEP) - depth) / STEP);
    let bumped = (normal + Vec3::from(slope) * 0.06).normalize_or(normal);
    let facing = if bumped.dot(eye(fragment.draw) - position) < 0.0 { -bumped } else { bumped };
    slot.normal = facing.extend(depth);
    Verdict::Keep
}

/// Pass 2: where light comes from.
fn refract(fragment: &Fragment<'_>, slot: &mut Slot) -> Verdict {
    let sight = (position(fragment) - eye(fragment.draw)).normalize_or(Vec3::NEG_Z);
    let normal = slot.normal.truncate();
    let cosine = (-sight.dot(normal)).clamp(0.0, 1.0);
    // Schlick's approximation, for glass in air.
    let share = 0.04 + 0.96 * (1.0 - cosine).powi(5);
    let bent = sight + normal * (cosine * 0.35);
    slot.refracted = environment(bent.normalize_or(sight)).extend(1.0 - share);
    slot.reflected = environment(sight + normal * (2.0 * cosine)).extend(share);
    Verdict::Keep
}

/// Pass 3: both, through the glass, which is dull in its pits.
fn show(slot: &Slot) -> Vec4 {
    let pit = slot.normal.w;
    let tint = Vec3::new(0.72, 0.88, 0.86) * (1.0 - 0.5 * pit);
    let alpha = (0.3 + 0.4 * pit).max(slot.reflected.w);
    let through = slot.refracted.truncate() * tint * slot.refracted.w * alpha;
    (through + slot.reflected.truncate() * slot.reflected.w).extend(alpha)
}

/// Light from a direction, of length 1: a sky over a floor of tiles, with two lamps.
pub fn environment(direction: Vec3) -> Vec3 {
    let lamp = |towards: Vec3, size: f32| smooth_step(size, size + 0.02, direction.dot(towards.normalize()));
    let lamps = lamp(Vec3::new(0.5, 0.7, 0.6), 0.93) + 0.6 * lamp(Vec3::new(-0.7, 0.4, 0.5), 0.96);
    let up = direction.y;
    if up >= 0.0 {
        let sky = Vec3::new(0.75, 0.8, 0.85).lerp(Vec3::new(0.12, 0.25, 0.5), up.sqrt());
        return sky + Vec3::new(4.0, 3.7, 3.2) * lamps;
    }
    let floor = direction / -up.min(-0.05);
    let is_dark = ((floor.x * 0.7).floor() + (floor.z * 0.7).floor()).rem_euclid(2.0) > 0.5;
    let tile = if is_dark { Vec3::new(0.12, 0.1, 0.09) } else { Vec3::new(0.5, 0.42, 0.33) };
    tile.lerp(Vec3::new(0.75, 0.8, 0.85), smooth_step(-0.3, 0.0, up))
}

/// How deep a pit is at a place of the surface: 0 to 1.
fn pit(position: Vec3) -> f32 {
    smooth_step(0.58, 0.78, noise(position * 7.0))
}

/// Smooth noise of 0 to 1: values at the corners of a lattice, blended.
fn noise(position: Vec3) -> f32 {
    let cell = position.floor();
    let within = position - cell;
    let blend = within * within * (Vec3::splat(3.0) - 2.0 * within);
    let corner = |x: f32, y: f32, z: f32| lattice(cell + Vec3::new(x, y, z));
    let along_x = |y, z| corner(0.0, y, z) + (corner(1.0, y, z) - corner(0.0, y, z)) * blend.x;
    let along_y = |z| along_x(0.0, z) + (along_x(1.0, z) - along_x(0.0, z)) * blend.y;
    along_y(0.0) + (along_y(1.0) - along_y(0.0)) * blend.z
}

/// A number of 0 to 1 for a corner of the lattice.
fn lattice(corner: Vec3) -> f32 {
    let [x, y, z] = corner.as_ivec3().to_array().map(|i| i as u32);
    let mixed = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ z.wrapping_mul(0xcb1a_b31f);
    let mixed = (mixed ^ (mixed >> 13)).wrapping_mul(0x5bd1_e995);
    ((mixed ^ (mixed >> 15)) >> 8) as f32 / 16_777_216.0
}

fn smooth_step(from: f32, to: f32, value: f32) -> f32 {
    let t = ((value - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn position(fragment: &Fragment<'_>) -> Vec3 {
    let positions = fragment.draw.mesh.positions();
    fragment.interpolate(fragment.vertices().map(|vertex| positions[vertex]))
}

/// Smooth where the mesh is.
fn normal(fragment: &Fragment<'_>) -> Vec3 {
    let mesh = fragment.draw.mesh;
    let [a, b, c] = fragment.vertices();
    match mesh.normals() {
        Some(normals) => fragment.interpolate([normals[a], normals[b], normals[c]]).normalize_or(Vec3::Z),
        None => {
            let positions = mesh.positions();
            (positions[b] - positions[a]).cross(positions[c] - positions[a]).normalize_or(Vec3::Z)
        }
    }
}

/// The eye in the mesh's space; very far away for parallel rays.
pub(super) fn eye(draw: &Draw<'_>) -> Vec3 {
    let eye = draw.clip_from_mesh.inverse() * Vec4::Z;
    if eye.w.abs() > 1e-20 { eye.truncate() / eye.w } else { eye.truncate() * 1e6 }
}
