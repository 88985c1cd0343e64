//! What every built-in scene must keep to.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use pellucid_core::{AlphaMode, Mesh, Projection, Scene};

use super::{Kind, all, make};

/// Everything of a scene in one value that two scenes can be compared by.
fn content(scene: &Scene) -> String {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    for mesh in scene.meshes() {
        mesh.triangles().hash(&mut hasher);
        for position in mesh.positions() {
            position.to_array().map(f32::to_bits).hash(&mut hasher);
        }
        for normal in mesh.normals().unwrap_or_default() {
            normal.to_array().map(f32::to_bits).hash(&mut hasher);
        }
        for color in mesh.colors().unwrap_or_default() {
            color.to_array().map(f32::to_bits).hash(&mut hasher);
        }
    }
    for instance in scene.instances() {
        (instance.mesh, instance.material).hash(&mut hasher);
        instance.world_from_mesh.to_cols_array().map(f32::to_bits).hash(&mut hasher);
    }
    format!("{:x} {:?} {:?}", hasher.finish(), scene.materials(), scene.cameras())
}

fn count(description: &str) -> u32 {
    make(description).unwrap().primitive_count()
}

fn error(description: &str) -> String {
    make(description).unwrap_err().to_string()
}

/// Edges that are not used exactly once in each direction. Vertices at one place count as one, as seams and creases have
/// several there.
fn open_edges(mesh: &Mesh) -> usize {
    let mut places = HashMap::new();
    let welded: Vec<usize> = mesh
        .positions()
        .iter()
        // Adding zero makes -0 and 0 one place.
        .map(|position| {
            let next = places.len();
            *places.entry((*position + 0.0).to_array().map(f32::to_bits)).or_insert(next)
        })
        .collect();
    let mut uses: HashMap<(usize, usize), i32> = HashMap::new();
    let mut doubled = 0;
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|vertex| welded[vertex as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let directed = uses.entry((from, to)).or_default();
            *directed += 1;
            doubled += usize::from(*directed > 1 || from == to);
        }
    }
    doubled + uses.keys().filter(|(from, to)| !uses.contains_key(&(*to, *from))).count()
}

fn volume(mesh: &Mesh) -> f64 {
    let corner = |vertex: u32| mesh.positions()[vertex as usize].as_dvec3();
    mesh.triangles().iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
}

#[test]
fn every_scene_builds_with_its_defaults() {
    for scene in all() {
        let made = make(scene.name).unwrap();
        assert!(made.primitive_count() > 0, "{}", scene.name);
        assert!(made.primitive_count() < 1_000_000, "{} is too large for a first look", scene.name);
        for mesh in made.meshes() {
            assert!(mesh.positions().iter().all(|position| position.is_finite()), "{}", scene.name);
            assert!(
                mesh.normals().unwrap_or_default().iter().all(|n| (n.length() - 1.0).abs() < 1e-3),
                "{}",
                scene.name
            );
        }
        for instance in made.instances() {
            assert!(instance.world_from_mesh.is_finite(), "{}", scene.name);
        }
        let sphere = made.bounding_sphere();
        assert!(sphere.center.is_finite() && (0.1..100.0).contains(&sphere.radius), "{}: {sphere:?}", scene.name);
        for camera in made.cameras() {
            camera.clip_from_world(16.0 / 9.0).unwrap();
        }
    }
}

#[test]
fn counts_are_what_the_parameters_say() {
    assert_eq!(count("boxes"), 12_000);
    assert_eq!(count("boxes:n=1"), 12);
    assert_eq!(count("boxes:n=7"), 12 * 7 * 7 * 7);
    assert_eq!(count("grids"), 10 * 20_000);
    assert_eq!(count("grids:layers=3,tessellation=5,coverage=0.5"), 3 * 2 * 25);
    assert_eq!(count("planes"), 32);
    assert_eq!(count("planes:n=4096"), 8192);
    assert_eq!(count("planes:n=3,tessellation=4"), 3 * 32);
    assert_eq!(count("spheres:n=5,subdivisions=2"), 5 * 320);
    assert_eq!(count("blocks:n=500"), 6_000);
    assert_eq!(count("cyclic:n=5"), 60);
    assert_eq!(count("hairball:strands=11,segments=24"), 11 * 146);
    // Half of the cells at the two poles of body and lid have only one triangle.
    assert_eq!(count("teapot:tessellation=10"), 32 * 2 * 100 - 80);
    assert_eq!(count("tree:leaves=100") - count("tree:leaves=0"), 800);
    assert!((50_000..=300_000).contains(&count("gallery")));
    // The original of the hairball, but for the caps.
    assert_eq!(count("hairball:strands=20000,segments=24"), 2_880_000 + 40_000);
}

#[test]
fn the_seed_decides_every_bit() {
    for scene in all() {
        assert_eq!(content(&make(scene.name).unwrap()), content(&make(scene.name).unwrap()), "{}", scene.name);
        if scene.parameters.iter().any(|parameter| parameter.name == "seed") {
            let [one, two] = [1, 2].map(|seed| content(&make(&format!("{}:seed={seed}", scene.name)).unwrap()));
            assert_ne!(one, two, "{}", scene.name);
            assert_eq!(one, content(&make(scene.name).unwrap()), "{}: the default seed is 1", scene.name);
        }
    }
}

#[test]
fn closed_things_are_closed_and_face_outwards() {
    let closed =
        ["boxes", "spheres", "blocks", "cyclic", "hairball", "glass", "glass:shells=1", "glass:shells=9,sides=3"];
    for name in closed {
        for (number, mesh) in make(name).unwrap().meshes().iter().enumerate() {
            assert_eq!(open_edges(mesh), 0, "mesh {number} of {name}");
            assert!(volume(mesh) > 0.0, "mesh {number} of {name} is inside out");
        }
    }
    // The wood of the tree is tubes with seams for the texture; knot and rings of the gallery close on themselves.
    assert_eq!(open_edges(&make("tree").unwrap().meshes()[0]), 0);
    assert_eq!(open_edges(&make("gallery:room=no").unwrap().meshes()[0]), 0);
    assert!(volume(&make("gallery:room=no").unwrap().meshes()[0]) > 0.0);
    for mesh in make("teapot").unwrap().meshes() {
        assert!(volume(mesh) > 0.0);
    }
}

#[test]
fn a_closed_mesh_with_a_hole_is_noticed() {
    let scene = make("spheres:n=1").unwrap();
    let sphere = &scene.meshes()[0];
    let holed = Mesh::new(sphere.positions().to_vec(), sphere.triangles()[1..].to_vec()).unwrap();
    assert_eq!(open_edges(&holed), 3);
}

#[test]
fn normals_agree_with_the_winding() {
    for name in ["spheres", "hairball", "tree", "glass", "teapot", "gallery"] {
        for mesh in make(name).unwrap().meshes() {
            let Some(normals) = mesh.normals() else { continue };
            let against = mesh
                .triangles()
                .iter()
                .filter(|triangle| {
                    let [a, b, c] = triangle.map(|vertex| mesh.positions()[vertex as usize]);
                    let sum = triangle.iter().map(|&vertex| normals[vertex as usize]).sum::<glam::Vec3>();
                    (b - a).cross(c - a).dot(sum) < 0.0
                })
                .count();
            assert!(against * 100 <= mesh.triangles().len(), "{against} in {name}");
        }
    }
}

#[test]
fn planes_lie_at_distinct_depths_and_cover_the_picture() {
    let scene = make("planes:n=65536,order=front").unwrap();
    let camera = scene.cameras()[0];
    let clip_from_world = camera.clip_from_world(4.0).unwrap();
    let mut last = f32::INFINITY;
    for instance in scene.instances() {
        let [low, high] = [[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]]
            .map(|corner| clip_from_world.project_point3(instance.world_from_mesh.transform_point3(corner.into())));
        assert!(low.z == high.z && low.z < last && low.z > 0.0 && low.z < 1.0);
        assert!(low.x < -1.0 && low.y < -1.0 && high.x > 1.0 && high.y > 1.0, "{low} {high}");
        last = low.z;
    }
    let order = |order: &str| -> Vec<f32> {
        let scene = make(&format!("planes:n=9,order={order}")).unwrap();
        scene.instances().iter().map(|instance| instance.world_from_mesh.translation.z).collect()
    };
    let (front, mut back, mut shuffled) = (order("front"), order("back"), order("shuffled"));
    assert_ne!(shuffled, front);
    back.reverse();
    assert_eq!(back, front);
    shuffled.sort_by(|a, b| b.total_cmp(a));
    assert_eq!(shuffled, front);
}

#[test]
fn grids_cover_the_share_that_was_asked_for() {
    for coverage in [1.0, 0.25, 0.07] {
        let scene = make(&format!("grids:coverage={coverage}")).unwrap();
        let (low, high) = scene.bounding_box().unwrap();
        let area = (high.x - low.x) * (high.y - low.y);
        let Projection::Orthographic { height, .. } = scene.cameras()[0].projection else { panic!("parallel rays") };
        assert!((area / (height * height * 16.0 / 9.0) - coverage).abs() < 1e-5);
    }
}

#[test]
fn bars_overlap_in_a_cycle_without_touching() {
    for n in [3, 4, 7, 20, 64] {
        let scene = make(&format!("cyclic:n={n}")).unwrap();
        let (half_angle, bars) = (std::f32::consts::PI / n as f32, scene.instances());
        // The corner of the polygon where the first bar ends and the second begins.
        let corner = glam::Vec3::new(half_angle.sin(), -half_angle.cos(), 0.0);
        let heights = [&bars[0], &bars[1]].map(|bar| {
            let axis = bar.world_from_mesh.transform_vector3(glam::Vec3::X);
            let center = glam::Vec3::from(bar.world_from_mesh.translation);
            let t = (corner - center).truncate().dot(axis.truncate()) / axis.truncate().length_squared();
            center.z + axis.z * t
        });
        let thickness = scene.meshes()[0].positions().iter().map(|p| p.z).fold(0.0, f32::max) * 2.0;
        assert!(heights[1] - heights[0] > 2.0 * thickness, "{n}: {heights:?}");
    }
}

#[test]
fn materials_are_of_the_promised_kind() {
    let modes = |name: &str| -> Vec<AlphaMode> {
        let scene = make(name).unwrap();
        scene.instances().iter().map(|instance| scene.material(instance.material).alpha_mode).collect()
    };
    assert!(modes("teapot").iter().all(|mode| *mode == AlphaMode::Opaque));
    assert!(modes("tree").contains(&AlphaMode::Mask { cutoff: 0.5 }));
    for name in ["boxes", "grids", "blocks", "planes", "cyclic", "hairball", "spheres:opaque=0"] {
        assert!(modes(name).iter().all(|mode| *mode == AlphaMode::Blend), "{name}");
    }
    let opaque = modes("spheres:n=200,opaque=25").iter().filter(|mode| **mode == AlphaMode::Opaque).count();
    assert_eq!(opaque, 50);
    let gallery = modes("gallery");
    assert!(gallery.contains(&AlphaMode::Opaque) && gallery.contains(&AlphaMode::Blend));
}

#[test]
fn every_edge_of_every_range_is_refused_beyond() {
    for scene in all() {
        for parameter in scene.parameters {
            let (low, high) = match parameter.kind {
                Kind::Integer { min, max } => (i64::from(min) - 1, i64::from(max) + 1),
                Kind::Number { min, max } => (min as i64 - 1, max as i64 + 1),
                Kind::Choice(_) => continue,
            };
            for value in [low.to_string(), high.to_string(), "NaN".into(), "inf".into(), String::new()] {
                let message = error(&format!("{}:{}={value}", scene.name, parameter.name));
                assert!(message.contains(&parameter.kind.to_string()), "{message}");
            }
        }
    }
}

#[test]
fn mistakes_are_explained() {
    assert!(error("boxs").contains("did you mean 'boxes'"), "{}", error("boxs"));
    assert!(error("nothing-like-it").contains("@gallery, @boxes"));
    assert!(!error("nothing-like-it").contains("did you mean"));
    assert!(error("").contains("@gallery"));
    assert!(error(&"x".repeat(1000)).contains("@gallery"));
    assert_eq!(error("boxes:m=3"), "@boxes: no parameter is called 'm' (did you mean 'n'?); known are n");
    assert!(error("grids:layer=3").contains("'layers'"));
    assert_eq!(error("boxes:n=0"), "@boxes: n takes a whole number from 1 to 255, not '0'");
    assert_eq!(error("boxes:n=3,n=4"), "@boxes: n is given twice");
    assert_eq!(error("boxes:n"), "@boxes: 'n' is not of the form key=value");
    assert!(error("boxes:").contains("key=value"));
    assert!(error("boxes:n=3,").contains("key=value"));
    assert!(error("planes:order=sideways").contains("one of shuffled, front, back"));
    assert!(make(" boxes : n = 2 ").is_ok());
}

#[test]
fn absurd_sizes_are_refused_before_anything_is_made() {
    let start = Instant::now();
    for description in [
        "boxes:n=100000",
        "spheres:n=1000000,subdivisions=8",
        "grids:layers=65536,tessellation=2000",
        "blocks:n=4294967295",
        "planes:n=65536,tessellation=1000",
        "hairball:strands=200000,segments=1000",
        "tree:leaves=99999999999999999999",
        "glass:shells=1000000",
        "teapot:tessellation=100000",
    ] {
        assert!(error(description).contains("at most") || error(description).contains("from"), "{description}");
    }
    assert!(start.elapsed() < Duration::from_secs(1));
}
