//! A tree: an opaque branching trunk with a bark texture, and alpha-masked sprigs of leaves.

use glam::{Affine3A, Quat, Vec2, Vec3};
use pellucid_core::scene::MaterialTexture;
use pellucid_core::texture::{Texture, Wrap};
use pellucid_core::{AlphaMode, Error, Material, Scene};

use super::painting::{lerp, noise, paint, smoothstep};
use super::palette::linear;
use super::parameters::{Parameter, SEED, Values, integer};
use super::random::{Random, rotation};
use super::shapes::{Shape, circle, grid, revolve};
use super::stage::{Stage, framing, turned};
use super::tube::Tube;
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] =
    &[integer("leaves", "9000", (0, 1_000_000), "sprigs of seven leaves, of 8 triangles each"), SEED];

/// Forks between the trunk and a twig.
const FORKS: u32 = 6;
/// Points along a branch.
const POINTS: usize = 6;
/// What a leaf's colour is multiplied with, outside the crown first.
const SHADES: [f32; 4] = [1.25, 0.9, 0.6, 0.38];
const HUES: [u32; 5] = [0xffffff, 0xe6f5c8, 0xfff0a8, 0xc9e0b4, 0xf6d890];
const SPRIG_SIZE: f32 = 0.1;

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let mut random = Random::new(values.integer("seed"));
    let mut stage = Stage::default();

    let mut wood = Wood { shape: Shape::default(), twigs: Vec::new() };
    let trunk = Branch { start: Vec3::ZERO, direction: Vec3::Y, length: 1.35, radius: 0.17, forks: FORKS };
    wood.grow(&mut random, &trunk);
    let bark = textured(&mut stage, "bark", bark_texture()?, AlphaMode::Opaque)?;
    let bark = stage.scene.add_material(bark)?;
    let mesh = stage.mesh(wood.shape.into_mesh()?)?;
    stage.put(mesh, bark, Affine3A::IDENTITY)?;

    let leaf = textured(&mut stage, "leaf", leaf_texture()?, AlphaMode::Mask { cutoff: 0.5 })?;
    let mut shades = Vec::new();
    for shade in SHADES {
        let mut hues = Vec::new();
        for hue in HUES {
            let base_color = (linear(hue) * shade).extend(1.0);
            hues.push(stage.scene.add_material(Material { base_color, ..leaf.clone() })?);
        }
        shades.push(hues);
    }
    let crown = Crown::around(&wood.twigs);
    let sprig = stage.mesh(sprig()?.into_smooth_mesh()?)?;
    for _ in 0..values.integer("leaves") {
        let twig = &wood.twigs[random.below(wood.twigs.len())];
        let along = random.unit();
        let foot = twig.start.lerp(twig.end, along);
        // A sprig points away from the twig, its upper side towards the light.
        let tip = (twig.end - twig.start).normalize_or(Vec3::Y) * along + random.direction() + Vec3::Y * 0.1;
        let upper = (Vec3::Y + random.in_ball() * 0.7).normalize_or(Vec3::Y);
        let place = turned(SPRIG_SIZE * random.between(0.7, 1.3), facing(tip, upper), foot);
        let hues = &shades[(crown.depth(foot) * (SHADES.len() - 1) as f32 + random.unit()) as usize];
        stage.put(sprig, hues[random.below(hues.len())], place)?;
    }
    let soil = [[0.0, -0.05], [1.0, -0.05], [1.0, -0.05], [0.98, 0.0], [0.6, 0.03], [0.0, 0.05]].map(Vec2::from);
    let soil = stage.mesh(revolve(&soil, &circle(64)).into_smooth_mesh()?)?;
    let earth = stage.solid("earth", 0x55602f)?;
    stage.put(soil, earth, Affine3A::IDENTITY)?;
    let height = wood.twigs.iter().map(|twig| twig.end.y).fold(0.0, f32::max) + SPRIG_SIZE;
    stage.scene.add_camera(framing(Vec3::new(0.0, height * 0.5, 0.0), height * 0.57));
    Ok(stage.scene)
}

struct Branch {
    start: Vec3,
    direction: Vec3,
    length: f32,
    radius: f32,
    forks: u32,
}

struct Twig {
    start: Vec3,
    end: Vec3,
}

/// Where the leaves are.
struct Crown {
    center: Vec3,
    radius: f32,
}

impl Crown {
    fn around(twigs: &[Twig]) -> Self {
        let center = twigs.iter().map(|twig| twig.end).sum::<Vec3>() / twigs.len() as f32;
        let radius = twigs.iter().map(|twig| twig.end.distance(center)).fold(f32::MIN_POSITIVE, f32::max);
        Self { center, radius }
    }

    /// From 0 at the outside to 0.999 in the middle or at the underside, where it is shady.
    fn depth(&self, point: Vec3) -> f32 {
        let lit = (point - self.center) / self.radius + Vec3::Y * 0.2;
        (1.1 - lit.length() * 1.2).clamp(0.0, 0.999)
    }
}

struct Wood {
    shape: Shape,
    twigs: Vec<Twig>,
}

impl Wood {
    /// Adds a branch and all that grows from it.
    fn grow(&mut self, random: &mut Random, branch: &Branch) {
        let step = branch.length / (POINTS - 1) as f32;
        let mut direction = branch.direction;
        let mut path = vec![branch.start];
        for _ in 1..POINTS {
            // Branches wander, and bend upwards to the light the thinner they are.
            let wander = random.in_ball() * 0.16;
            let light = Vec3::Y * 0.06;
            direction = (direction + wander + light).normalize_or(direction);
            path.push(path[path.len() - 1] + direction * step);
        }
        let tip_radius = if branch.forks == 0 { 0.002 } else { branch.radius * 0.72 };
        let radii: Vec<f32> = (0..POINTS)
            .map(|i| {
                let flare = if branch.forks == FORKS { 0.6 * (1.0 - i as f32).max(0.0) } else { 0.0 };
                lerp(branch.radius, tip_radius, i as f32 / (POINTS - 1) as f32) * (1.0 + flare)
            })
            .collect();
        let sides = [5, 5, 6, 8, 10, 14, 20][branch.forks as usize];
        let repeats = Vec2::new(1.0, (branch.length / (6.0 * branch.radius)).max(1.0).round());
        Tube { path: &path, radii: &radii, sides, texture_repeats: Some(repeats), ..Tube::default() }
            .add_to(&mut self.shape);
        if branch.forks <= 1 {
            self.twigs.extend(path.windows(2).map(|piece| Twig { start: piece[0], end: piece[1] }));
        }
        if branch.forks == 0 {
            return;
        }
        let children = if branch.forks == FORKS { 5 } else { 2 + random.below(2) };
        let first_turn = random.unit();
        for child in 0..children {
            let around = rotation(direction, first_turn + child as f32 / children as f32 + random.between(-0.06, 0.06));
            let aside = around * direction.any_orthonormal_vector();
            let spread = if branch.forks == FORKS { random.between(0.6, 1.1) } else { random.between(0.5, 1.0) };
            let next = Branch {
                start: path[POINTS - 1],
                direction: (direction + aside * spread).normalize_or(direction),
                length: branch.length * random.between(0.62, 0.8),
                radius: tip_radius * random.between(0.62, 0.85),
                forks: branch.forks - 1,
            };
            self.grow(random, &next);
        }
    }
}

/// The rotation that takes +y to `tip` and +z as near to `upper` as can be.
fn facing(tip: Vec3, upper: Vec3) -> Quat {
    let y = tip.normalize_or(Vec3::Y);
    let z = upper.reject_from_normalized(y).normalize_or(y.any_orthonormal_vector());
    Quat::from_mat3(&glam::Mat3::from_cols(y.cross(z), y, z))
}

/// A card from y = 0 to 2, folded along the middle and bent down at the tip.
fn sprig() -> Result<Shape, Error> {
    let mut shape = grid(2, 2);
    for position in &mut shape.positions {
        let along = position.y + 1.0;
        position.z = position.x.abs() * 0.25 - along * along * 0.1;
        position.y = along;
    }
    Ok(shape)
}

fn textured(stage: &mut Stage, name: &str, texture: Texture, alpha_mode: AlphaMode) -> Result<Material, Error> {
    let texture = stage.scene.add_texture(texture)?;
    let texture = Some(MaterialTexture { texture, transform: glam::Affine2::IDENTITY });
    Ok(Material { name: name.into(), texture, alpha_mode, ..Material::default() })
}

fn bark_texture() -> Result<Texture, Error> {
    paint(256, Wrap::Repeat, |u, v| {
        let bend = noise(u, v, 4, 4, 1) * 0.12;
        let ridges = noise(u + bend, v, 18, 3, 2) * 0.6 + noise(u + bend, v, 36, 10, 3) * 0.4;
        let furrow = smoothstep(0.3, 0.62, ridges);
        let grain = noise(u, v, 64, 64, 4) * 0.16;
        let shade = lerp(0.36, 1.0, furrow) - grain;
        [0.56 * shade, 0.45 * shade, 0.36 * shade, 1.0]
    })
}

/// Seven leaflets on a stem that grows from the bottom edge.
fn leaf_texture() -> Result<Texture, Error> {
    paint(256, Wrap::ClampToEdge, |u, v| {
        let (x, y) = (u * 2.0 - 1.0, (1.0 - v) * 2.0);
        let stem = x.abs() < 0.022 && y < 1.3;
        let mut best: Option<(f32, f32, f32)> = None;
        for (foot, slope, length) in LEAFLETS {
            // Leaf coordinates: along the midrib in 0..1, and across it.
            let axis = Vec2::from(slope).normalize();
            let from_foot = Vec2::new(x, y - foot);
            let (along, across) = (from_foot.dot(axis) / length, from_foot.perp_dot(axis) / length);
            if !(0.0..=1.0).contains(&along) {
                continue;
            }
            let teeth = 1.0 + 0.07 * ((along * 14.0).fract() - 0.5);
            let half_width = 0.95 * along.sqrt() * (1.0 - along) * teeth;
            let inside = half_width - across.abs();
            if inside > 0.0 && best.is_none_or(|(other, _, _)| inside > other) {
                best = Some((inside, along, across));
            }
        }
        let Some((inside, along, across)) = best else {
            // Leaf colour where nothing is, so that filtering never meets another hue.
            return if stem { [0.42, 0.44, 0.2, 1.0] } else { [0.3, 0.46, 0.16, 0.0] };
        };
        let midrib = 1.0 - smoothstep(0.0, 0.025, across.abs());
        let veins = ((along - across.abs() * 0.8) * 7.0).fract();
        let vein = (1.0 - smoothstep(0.0, 0.12, (veins - 0.5).abs())) * smoothstep(0.0, 0.05, inside) * 0.5;
        let light = (midrib * 0.9 + vein).min(1.0);
        let mottle = noise(u, v, 24, 24, 9) * 0.1 - 0.05;
        [
            lerp(0.27, 0.6, light) + mottle + 0.1 * along,
            lerp(0.47, 0.72, light) + mottle,
            lerp(0.13, 0.34, light) + mottle * 0.5,
            1.0,
        ]
    })
}

/// Height of the foot on the stem, direction, length; the sprig is 2 wide and 2 high.
const LEAFLETS: [(f32, [f32; 2], f32); 7] = [
    (0.28, [1.0, 0.35], 0.78),
    (0.28, [-1.0, 0.35], 0.78),
    (0.68, [1.0, 0.55], 0.86),
    (0.68, [-1.0, 0.55], 0.86),
    (1.02, [0.8, 0.75], 0.8),
    (1.02, [-0.8, 0.75], 0.8),
    (1.16, [0.0, 1.0], 0.8),
];
