//! Scenes whose picture is known beforehand.

#[path = "common/flat_view.rs"]
mod flat_view;

use std::cmp::Reverse;

use glam::{Affine3A, Vec3, Vec4};
use pellucid::core::fragment::order_key;
use pellucid::{Instance, Layers, Material, Mesh, Renderer, Resolve, Scene, Shading, Technique, View};
use pellucid_cpu::CpuRenderer;
use pellucid_cpu::simd::levels;

use flat_view::flat_view;

const BOTH: [Technique; 2] = [Technique::Cpu, Technique::Oracle];

/// Pixels a side.
const SIDE: u32 = 24;

fn quad(scene: &mut Scene, corners: [Vec3; 4], color: Vec4) {
    let mesh = scene.add_mesh(Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap()).unwrap();
    let material = scene.add_material(Material::translucent("", color)).unwrap();
    scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
}

fn square(scene: &mut Scene, z: f32, color: Vec4) {
    quad(scene, [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]].map(|[x, y]| Vec3::new(x, y, z)), color);
}

#[test]
fn n_planes_of_alpha_a_leave_the_nth_power_of_the_background() {
    for (count, alpha) in [(1, 0.5f32), (7, 0.3), (64, 0.05), (500, 0.01)] {
        let mut scene = Scene::new();
        for i in 0..count {
            // Neither front to back nor back to front.
            let z = ((i * 389) % count) as f32 / count as f32;
            square(&mut scene, z, Vec4::new(0.0, 0.0, 0.0, alpha));
        }
        let view = flat_view(&scene, SIDE, SIDE).background(Vec4::new(1.0, 0.5, 0.25, 1.0));
        let expected = Vec3::new(1.0, 0.5, 0.25) * (1.0 - alpha).powi(count);
        for technique in BOTH {
            let frame = Renderer::new().technique(technique).render(&scene, &view, Resolve::Blend).unwrap();
            assert_eq!(frame.stats.max_depth_complexity, count as u32);
            assert_eq!(frame.stats.fragments, u64::from(view.width * view.height) * count as u64);
            for pixel in frame.image.pixels() {
                assert!(
                    (pixel.truncate() - expected).abs().max_element() < 1e-5,
                    "{technique}: {pixel}, not {expected}"
                );
                assert!((pixel.w - 1.0).abs() < 1e-6);
            }
        }
    }
}

/// Blending may end where nothing behind changes a bit, and no earlier: behind so many layers that hardly anything gets
/// through stands one that has what those lack, or is much brighter, and then more that change nothing.
#[test]
fn what_hardly_gets_through_is_seen_where_nothing_outshines_it() {
    let grey = |value: f32, alpha: f32| Vec4::new(value, value, value, alpha);
    let green = Vec4::new(0.0, 1.0, 0.0, 0.5);
    for (layers, front, behind, ends_early) in [
        (40, green, Vec4::new(1.0, 0.0, 0.0, 1.0), false),
        (25, grey(0.001, 0.5), grey(1.0, 1.0), false),
        (30, grey(1.0, 0.5), grey(60_000.0, 1.0), false),
        (56, grey(1.0, 0.5), grey(1.0, 1.0), true),
    ] {
        let mut scene = Scene::new();
        let add = |scene: &mut Scene, number: u32, color| {
            let z = 0.9 - number as f32 / 100.0;
            let corners = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]].map(|[x, y]| Vec3::new(x, y, z));
            let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
            let mesh = scene.add_mesh(mesh.with_colors(vec![color; 4]).unwrap()).unwrap();
            let material = scene.add_material(Material::translucent("", Vec4::ONE)).unwrap();
            scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
        };
        (0..layers).for_each(|number| add(&mut scene, number, front));
        let view = flat_view(&scene, SIDE, SIDE);
        let render = |scene: &Scene, technique| {
            Renderer::new().technique(technique).render(scene, &view, Resolve::Blend).unwrap().image
        };
        let without = render(&scene, Technique::Oracle);
        add(&mut scene, layers, behind);
        (layers + 1..layers + 12).for_each(|number| add(&mut scene, number, front));
        let expected = render(&scene, Technique::Oracle);
        assert_eq!(expected == without, ends_early, "{layers} layers");
        assert!(render(&scene, Technique::Cpu) == expected, "{layers} layers");
    }
}

/// Also of a background that is not a colour, such as one to be measured by: it counts until as little of it gets through.
#[test]
fn what_gets_through_to_a_background_of_any_alpha_is_seen() {
    let mut scene = Scene::new();
    (0..200).for_each(|i| square(&mut scene, i as f32 / 200.0, Vec4::new(0.9, 0.9, 0.9, 0.5)));
    for alpha in [0.0, 1.0, -3.0, 1e6, -1e9] {
        let view = flat_view(&scene, SIDE, SIDE).background(Vec4::new(0.5, 0.5, 0.5, alpha));
        let render =
            |technique| Renderer::new().technique(technique).render(&scene, &view, Resolve::Blend).unwrap().image;
        assert!(render(Technique::Cpu) == render(Technique::Oracle), "{alpha}");
    }
}

/// Pixels of any number of layers, some of them equally deep: each pixel in an order of its own, then all in one.
#[test]
fn layers_come_out_in_order_at_any_number_and_level() {
    // Two strips of the eight that are sorted side by side.
    const PIXELS: usize = 16;
    for count in (1..72).chain([95, 96, 97, 128, 129, 255, 256, 257, 500, 1000]) {
        for alike in [false, true] {
            let mut state = count as u64;
            let mut random = move || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 33) as usize % 1000
            };
            let (mut positions, mut expected) = (Vec::new(), vec![Vec::new(); PIXELS]);
            for layer in 0..count {
                let common = random();
                for (pixel, expected) in expected.iter_mut().enumerate() {
                    let nearness = if alike { common } else { random() };
                    if !alike && pixel % 3 == 2 && layer < random() % 4 {
                        continue;
                    }
                    expected.push((nearness, positions.len() as u32 / 3));
                    let (x, z) = ((2 * pixel + 1) as f32 - PIXELS as f32, nearness as f32 / 1000.0);
                    positions.extend([Vec3::new(x - 0.5, -0.4, z), Vec3::new(x + 0.5, -0.4, z), Vec3::new(x, 0.6, z)]);
                }
            }
            let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let mut scene = Scene::new();
            let mesh = scene.add_mesh(Mesh::new(positions, triangles).unwrap()).unwrap();
            let material = scene.add_material(Material::translucent("", Vec4::splat(0.5))).unwrap();
            scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
            for layers in &mut expected {
                layers.sort_unstable_by_key(|&key| Reverse(key));
            }
            let view = flat_view(&scene, PIXELS as u32, 1);
            for (name, level) in levels() {
                let visit = |layers: &Layers| {
                    for (pixel, expected) in (0..).zip(&expected) {
                        let primitives = layers.pixel(pixel, 0).iter().map(|fragment| fragment.primitive);
                        assert!(primitives.eq(expected.iter().map(|&(_, number)| number)), "{count} layers at {name}");
                    }
                };
                CpuRenderer::new(1).level(level).layers(&scene, &view, visit).unwrap();
            }
        }
    }
}

#[test]
fn of_coplanar_quads_the_later_is_in_front() {
    let (red, green) = (Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 1.0, 0.0, 1.0));
    for (first, second) in [(red, green), (green, red)] {
        let mut scene = Scene::new();
        square(&mut scene, 0.3, first);
        square(&mut scene, 0.3, second);
        for technique in BOTH {
            let view = flat_view(&scene, SIDE, SIDE);
            let frame = Renderer::new().technique(technique).render(&scene, &view, Resolve::Blend).unwrap();
            assert!(frame.image.pixels().iter().all(|&pixel| pixel == second), "{technique}");
        }
    }
}

/// Three bars, each over the next: no order of whole triangles is right (LFB chapter, figure 20.2).
#[test]
fn cyclically_overlapping_bars_are_right_where_they_cross() {
    let colors = [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 1.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0)];
    let mut scene = Scene::new();
    let directions =
        [0.0f32, 120.0, 240.0].map(|degrees| Vec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0));
    for (direction, color) in directions.into_iter().zip(colors) {
        let across = Vec3::new(-direction.y, direction.x, 0.0);
        let middle = across * -0.3;
        // Rises from its beginning to its end.
        let (from, to) = (middle - direction - Vec3::Z * 0.5, middle + direction + Vec3::Z * 0.5);
        let half = across * 0.12;
        quad(&mut scene, [from - half, to - half, to + half, from + half], color);
    }
    let view = flat_view(&scene, 240, 240);
    for technique in BOTH {
        let frame = Renderer::new().technique(technique).render(&scene, &view, Resolve::Blend).unwrap();
        let at = |position: Vec3| {
            let (x, y) = ((position.x + 1.0) * 120.0, (1.0 - position.y) * 120.0);
            frame.image.pixel(x as u32, y as u32)
        };
        for i in 0..3 {
            let j = (i + 1) % 3;
            // Where the middle lines of bar i and the next one cross: late on i, which is high, early on j, which is low.
            let (d, n) = (directions[i], directions[j]);
            let (p, q) = (Vec3::new(-d.y, d.x, 0.0) * -0.3, Vec3::new(-n.y, n.x, 0.0) * -0.3);
            let t = (q - p).cross(n).z / d.cross(n).z;
            let u = (q - p).cross(d).z / d.cross(n).z;
            let (front, expected) = if t > u { (i, colors[i]) } else { (j, colors[j]) };
            assert_eq!(at(p + d * t), expected, "{technique}: bar {front} is in front where {i} and {j} cross");
        }
        let wins: Vec<_> = frame.image.pixels().iter().filter(|pixel| pixel.w > 0.0).collect();
        assert!(colors.iter().all(|color| wins.contains(&color)));
    }
}

#[test]
fn every_order_of_the_triangles_gives_the_same_bits() {
    // Crossing quads, none coplanar with another.
    let quads: Vec<[Vec3; 4]> = (0..7)
        .map(|i| {
            let angle = i as f32 * 0.45 + 0.1;
            let (sin, cos) = angle.sin_cos();
            [(-1.0, -0.8), (1.0, -0.9), (0.9, 1.0), (-0.8, 0.7)]
                .map(|(u, v)| Vec3::new(u * cos + 0.02 * i as f32, v + 0.01 * i as f32, u * sin))
        })
        .collect();
    let picture = |order: &[usize], technique| {
        let mut scene = Scene::new();
        for &i in order {
            let hue = i as f32 / 7.0;
            quad(&mut scene, quads[i], Vec4::new(hue, 1.0 - hue, 0.5, 0.4));
        }
        let view = View { shading: Shading::Lit, ..flat_view(&scene, 65, 47) };
        Renderer::new().technique(technique).render(&scene, &view, Resolve::Blend).unwrap().image
    };
    for technique in BOTH {
        let expected = picture(&[0, 1, 2, 3, 4, 5, 6], technique);
        assert!(expected.pixels().iter().any(|pixel| pixel.w > 0.7));
        // Every rotation of every stride: 42 of the permutations, each triangle at each place.
        for stride in 1..7 {
            for start in 0..7 {
                let order: Vec<usize> = (0..7).map(|i| (start + i * stride) % 7).collect();
                assert!(picture(&order, technique) == expected, "{technique}: {order:?}");
            }
        }
    }
}

#[test]
fn opaque_surfaces_hide_what_is_behind_but_not_what_is_level() {
    let mut scene = Scene::new();
    square(&mut scene, 0.0, Vec4::new(0.0, 0.0, 1.0, 0.5)); // behind
    square(&mut scene, 0.5, Vec4::new(0.0, 1.0, 0.0, 0.5)); // level, drawn earlier
    let mesh = scene.instances()[1].mesh;
    let material = scene.add_material(Material::opaque("wall", Vec3::X)).unwrap();
    scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
    for technique in BOTH {
        let view = flat_view(&scene, SIDE, SIDE);
        let frame = Renderer::new().technique(technique).render(&scene, &view, Resolve::Blend).unwrap();
        assert_eq!(frame.stats.max_depth_complexity, 1, "{technique}");
        assert!(frame.image.pixels().iter().all(|&pixel| pixel == Vec4::new(0.5, 0.5, 0.0, 1.0)), "{technique}");
    }
    assert!(order_key(0.5, 3) > order_key(0.5, 2));
}
