//! A ball of curling hair: thin tubes, many layers deep everywhere.

use glam::{Affine3A, Vec3};
use pellucid_core::{Material, Scene};

use super::palette::gradient;
use super::parameters::{MAX_STORED_TRIANGLES, Parameter, SEED, Values, check_triangles, integer, number};
use super::random::Random;
use super::shapes::Shape;
use super::stage::{Stage, framing};
use super::tube::Tube;
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] = &[
    integer("strands", "1500", (1, 200_000), "hairs; 20000 of 24 segments are 2.9 million triangles"),
    integer("segments", "32", (2, 1_000), "pieces of a hair, of 6 triangles each"),
    number("radius", "0.007", (0.0001, 0.1), "of a hair at its root; the ball has radius 1"),
    SEED,
];

const SIDES: u32 = 3;
/// Hairs of one tone make a mesh.
const TONES: u32 = 8;
/// Length of a hair; the core it grows from has radius 0.25.
const LENGTH: f32 = 1.9;
const CORE_RADIUS: f32 = 0.25;

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let (strands, segments) = (values.integer("strands"), values.integer("segments"));
    let per_strand = Tube::triangle_count(u64::from(SIDES), u64::from(segments));
    check_triangles("hairball", MAX_STORED_TRIANGLES, &[u64::from(strands), per_strand])?;
    let mut random = Random::new(values.integer("seed"));
    let radius = values.number("radius");
    let radii: Vec<f32> = (0..=segments).map(|i| radius * (1.0 - 0.75 * i as f32 / segments as f32)).collect();

    let mut stage = Stage::default();
    for tone in 0..TONES {
        let mut shape = Shape::default();
        for _ in (tone..strands).step_by(TONES as usize) {
            let path = strand(&mut random, segments);
            Tube { path: &path, radii: &radii, sides: SIDES, ..Tube::default() }.add_to(&mut shape);
        }
        if !shape.triangles.is_empty() {
            let color = gradient(&[0x4a2a17, 0xa4622a, 0xe0a84e, 0xf6dfa4], tone as f32 / (TONES - 1) as f32);
            let name = format!("tone {tone}");
            let material = stage.scene.add_material(Material::translucent(name, color.extend(0.5)))?;
            let mesh = stage.mesh(shape.into_mesh()?)?;
            stage.put(mesh, material, Affine3A::IDENTITY)?;
        }
    }
    stage.scene.add_camera(framing(Vec3::ZERO, 1.08));
    Ok(stage.scene)
}

/// A hair that starts straight out from the core, curls about an axis of its own and turns back at the ball's surface.
fn strand(random: &mut Random, segments: u32) -> Vec<Vec3> {
    let step = LENGTH / segments as f32;
    let mut direction = random.direction();
    let mut position = direction * CORE_RADIUS;
    let axis = random.direction();
    let curl = random.between(2.0, 5.0) * step;
    let mut path = Vec::with_capacity(segments as usize + 1);
    path.push(position);
    for _ in 0..segments {
        let inwards = -position * ((position.length() - 0.7).max(0.0) * 22.0 * step).min(0.6);
        let wind = axis.cross(direction) * curl;
        direction = (direction + wind + random.in_ball() * 2.0 * step + inwards).normalize_or(direction);
        position += direction * step;
        path.push(position);
    }
    path
}
