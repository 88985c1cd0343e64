//! The OBJ loader, with MTL.

mod common;

use common::{Files, damaged, error, every_prefix, png, scene_file};
use glam::{Vec2, Vec3, Vec4};
use pellucid_core::color::linear_from_srgb;
use pellucid_core::texture::Wrap;
use pellucid_core::{AlphaMode, Material, Mesh};
use pellucid_scene::{LoadError, Loaded, NoAssets, load_file, obj};
use proptest::prelude::*;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn load(text: impl AsRef<[u8]>) -> Loaded {
    obj::parse(text.as_ref(), &NoAssets).unwrap()
}

/// Loads without a warning, and gives the only mesh.
fn mesh(text: impl AsRef<[u8]>) -> Mesh {
    let loaded = load(text);
    assert_eq!(loaded.warnings, [""; 0]);
    assert_eq!(loaded.scene.meshes().len(), 1);
    loaded.scene.meshes()[0].clone()
}

#[test]
fn every_form_of_corner_is_read() {
    let vertices = format!("{SQUARE}vt 0 0\nvt 1 0.25\nvt 1 1\nvn 0 0 1\nvn 0 1 0\n");
    let plain = mesh(format!("{vertices}f 1 2 3\n"));
    assert_eq!((plain.positions()[2], plain.tex_coords()), (Vec3::new(1.0, 1.0, 0.0), None));
    assert_eq!(plain.normals().unwrap(), [Vec3::Z; 3]);

    let textured = mesh(format!("{vertices}f 1/1 2/2 3/3\n"));
    assert_eq!(textured.tex_coords().unwrap()[..2], [Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.75)]);

    let normals = mesh(format!("{vertices}f 1//2 2//2 3//1\n"));
    assert_eq!(normals.normals().unwrap(), [Vec3::Y, Vec3::Y, Vec3::Z]);
    assert!(normals.tex_coords().is_none());

    let all = mesh(format!("{vertices}f 1/1/2 2/2/2 3/3/2\n"));
    assert_eq!((all.normals().unwrap()[0], all.tex_coords().unwrap()[2]), (Vec3::Y, Vec2::new(1.0, 0.0)));

    let backwards = mesh(format!("{vertices}f -4/-3/-1 -3/-2/-1 -2/-1/-1\nv 9 9 9\n"));
    assert_eq!(backwards.positions(), all.positions());
    assert_eq!((backwards.normals(), backwards.tex_coords()), (all.normals(), all.tex_coords()));
}

#[test]
fn corners_used_twice_are_one_vertex() {
    let square = mesh(format!("{SQUARE}f 1 2 3 4\n"));
    assert_eq!((square.positions().len(), square.triangles()), (4, [[0, 1, 2], [0, 2, 3]].as_slice()));
    // Another normal makes another vertex.
    let creased = mesh(format!("{SQUARE}vn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n"));
    assert_eq!(creased.positions().len(), 6);
}

#[test]
fn concave_polygons_are_not_fanned() {
    let arrow = mesh("v 0 0 0\nv 4 -3 0\nv 1 0 0\nv 4 3 0\nf 2 3 4 1\n");
    let area: f32 = arrow
        .triangles()
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| arrow.positions()[v as usize]);
            let area = (b - a).cross(c - a).z / 2.0;
            assert!(area > 0.0);
            area
        })
        .sum();
    assert_eq!(area, 3.0);
    let crossed = load("v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nv -3 0.5 0\nf 1 2 3 4 5\n");
    assert_eq!(crossed.scene.primitive_count(), 3);
}

#[test]
fn odd_ways_to_write_it_are_understood() {
    let text = "\u{feff}# a comment that ends in \\\r\no thing\r\ng a b\r\n  v 0 0 \\\r\n 0 1.0 # with a weight\r\n\
        v\t1 0 0\r\n\r\nv 0 1 0\r\nf 1 2 \\\r\n\\\r\n3";
    assert_eq!(mesh(text).positions(), [Vec3::ZERO, Vec3::X, Vec3::Y]);
    let shapes = load(format!("{SQUARE}l 1 2\np 1 2 3\nf 1 2 3\nsurf 0 1 0 1 1 2\nnonsense 1\n"));
    assert_eq!(shapes.scene.primitive_count(), 1);
    let [unknown, elements, surfaces] = &shapes.warnings[..] else { panic!("{:?}", shapes.warnings) };
    assert!(unknown.contains("line 9: 'nonsense'"), "{unknown}");
    assert!(elements == "lines and points, left out: 2", "{elements}");
    assert!(surfaces.ends_with("left out: 1"), "{surfaces}");
}

#[test]
fn colours_of_vertices_are_decoded() {
    let colored = mesh("v 0 0 0\nv 1 0 0 1 0.5 0\nv 0 1 0 7 -1 nan\nv 1 1 1\nf 1 2 3 4\n");
    let half = linear_from_srgb(0.5);
    let expected = [Vec4::ONE, Vec4::new(1.0, half, 0.0, 1.0), Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::ONE];
    assert_eq!(colored.colors().unwrap(), expected);
}

/// Two faces of a roof, without normals.
const ROOF: &str = "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 1\nv 1 2 0\nv 0 2 0\n";

#[test]
fn normals_are_smooth_unless_told_otherwise() {
    let faces = "f 1 2 3 4\nf 3 5 6 4\n";
    let ridge = |mesh: &Mesh| {
        let at = mesh.positions().iter().position(|p| *p == Vec3::new(1.0, 1.0, 1.0)).unwrap();
        mesh.normals().map(|normals| normals[at])
    };
    let close = |normal: Option<Vec3>, to: Vec3| assert!((normal.unwrap() - to).length() < 1e-6, "{normal:?}");
    close(ridge(&mesh(format!("{ROOF}{faces}"))), Vec3::Z);
    close(ridge(&mesh(format!("{ROOF}s 1\n{faces}"))), Vec3::Z);
    assert_eq!(ridge(&mesh(format!("{ROOF}s off\n{faces}"))), None);
    assert_eq!(ridge(&mesh(format!("{ROOF}s 0\n{faces}"))), None);
    let two_groups = mesh(format!("{ROOF}s 1\nf 1 2 3 4\ns 2\nf 3 5 6 4\n"));
    assert_eq!(two_groups.positions().len(), 8);
    close(ridge(&two_groups), Vec3::new(0.0, -1.0, 1.0).normalize());
    // A seam of the texture is none of the surface.
    let seam = mesh(format!("{ROOF}vt 0 0\nvt 1 1\nf 1/1 2/1 3/1 4/1\nf 3/2 5/2 6/2 4/2\n"));
    assert_eq!(seam.positions().len(), 8);
    close(ridge(&seam), Vec3::Z);
    // Given normals are kept, even if they are to be flat; those that point nowhere are made.
    let given = mesh(format!("{ROOF}vn 0 1 0\nvn 0 0 0\ns off\nf 1//1 2//1 3//1 4//2\n"));
    assert_eq!(ridge(&given), Some(Vec3::Y));
    close(given.normals().map(|n| n[3]), Vec3::new(0.0, -1.0, 1.0).normalize());
}

#[test]
fn smooth_and_flat_faces_of_a_material_are_two_meshes() {
    let loaded = load(format!("{ROOF}f 1 2 3\ns off\nf 1 3 4\ns 1\nf 4 3 5\n"));
    let [smooth, flat] = loaded.scene.meshes() else { panic!() };
    assert_eq!((smooth.triangles().len(), flat.triangles().len()), (2, 1));
    assert!(smooth.normals().is_some() && flat.normals().is_none());
    assert_eq!(loaded.scene.materials().len(), 1);
}

fn with_library(library: &str) -> Files {
    let half = [[200, 0, 0, 255], [0, 200, 0, 255], [0, 0, 200, 255], [9, 9, 9, 128]];
    let leaf = [[200, 0, 0, 255], [0, 200, 0, 255], [0, 0, 200, 0], [9, 9, 9, 0]];
    let opaque = [[200, 0, 0, 255]; 4];
    Files::of(&[
        ("my lib.mtl", library.as_bytes()),
        ("other.mtl", b"newmtl other\nKd 0 0 1\n"),
        ("graded.png", &png(2, 2, &half)),
        ("sub dir/leaf.png", &png(2, 2, &leaf)),
        ("opaque.png", &png(2, 2, &opaque)),
        ("grey.png", &png(1, 2, &[[255, 255, 255, 255], [0, 0, 0, 255]])),
        ("broken.png", b"no picture"),
    ])
}

fn try_material(library: &str) -> Result<(Loaded, Material), LoadError> {
    let text = format!("mtllib my lib.mtl\n{SQUARE}usemtl a material\nf 1 2 3\n");
    let loaded = obj::parse(text.as_bytes(), &with_library(&format!("newmtl a material\n{library}")))?;
    let material = loaded.scene.materials()[0].clone();
    Ok((loaded, material))
}

fn material(library: &str) -> (Loaded, Material) {
    let (loaded, material) = try_material(library).unwrap();
    assert_eq!(loaded.warnings, [""; 0]);
    (loaded, material)
}

#[test]
fn materials_become_instances_in_order_of_use() {
    let text = format!(
        "mtllib my lib.mtl\nmtllib other.mtl\n{SQUARE}f 1 2 3\nusemtl other\nf 1 2 3\nusemtl a\nf 1 2 3\nusemtl other\n\
         f 1 2 3\n"
    );
    let loaded = obj::parse(text.as_bytes(), &with_library("newmtl a\nKd 1 0 0\nnewmtl unused\nmap_Kd ../x")).unwrap();
    assert_eq!(loaded.warnings, [""; 0]);
    let drawn: Vec<_> = loaded
        .scene
        .instances()
        .iter()
        .map(|i| (loaded.scene.material(i.material).name.as_str(), loaded.scene.mesh(i.mesh).triangles().len()))
        .collect();
    assert_eq!(drawn, [("", 1), ("other", 2), ("a", 1)]);
    assert_eq!(loaded.scene.materials()[1].base_color, Vec4::new(0.0, 0.0, 1.0, 1.0));
    assert_eq!(loaded.scene.materials()[0], Material::default());
}

#[test]
fn one_line_may_name_several_libraries() {
    let text = format!("mtllib other.mtl missing.mtl\n{SQUARE}usemtl other\nf 1 2 3\n");
    let loaded = obj::parse(text.as_bytes(), &with_library("")).unwrap();
    assert_eq!(loaded.scene.materials()[0].base_color.z, 1.0);
    assert_eq!(loaded.warnings.len(), 1);
    assert!(loaded.warnings[0].contains("'missing.mtl'"), "{:?}", loaded.warnings);
}

#[test]
fn base_colour_is_decoded_and_alpha_makes_transparent() {
    let (_, plain) = material("Kd 1 0.5 0\nKa 9 9 9\nillum 2\n");
    assert_eq!(plain.base_color, Vec4::new(1.0, linear_from_srgb(0.5), 0.0, 1.0));
    assert_eq!((plain.alpha_mode, plain.double_sided), (AlphaMode::Opaque, true));
    for text in ["d 0.25", "Tr 0.75", "Tr 0\nd 0.25"] {
        let (_, glass) = material(text);
        assert_eq!((glass.base_color.w, glass.alpha_mode), (0.25, AlphaMode::Blend), "{text}");
    }
}

#[test]
fn the_alpha_of_textures_says_how_they_are_drawn() {
    let mask = AlphaMode::Mask { cutoff: 0.5 };
    for (library, mode, alphas) in [
        ("map_Kd opaque.png", AlphaMode::Opaque, [255; 4]),
        ("map_Kd graded.png", AlphaMode::Blend, [255, 255, 255, 128]),
        ("map_Kd -clamp on .\\sub dir\\leaf.png", mask, [255, 255, 0, 0]),
        ("map_Kd opaque.png\nmap_d grey.png", mask, [255, 255, 0, 0]),
        ("map_d graded.png", AlphaMode::Blend, [255, 255, 255, 128]),
        ("map_Kd sub dir/leaf.png\nd 0.5", AlphaMode::Blend, [255, 255, 0, 0]),
    ] {
        let (loaded, material) = material(library);
        assert_eq!(material.alpha_mode, mode, "{library}");
        let texture = loaded.scene.texture(material.texture.unwrap().texture);
        let found: Vec<_> = texture.level_texels(&texture.levels()[0]).iter().map(|texel| texel[3]).collect();
        assert_eq!(found, alphas, "{library}");
        let clamped = library.contains("clamp");
        assert_eq!(texture.sampler().wrap_u, if clamped { Wrap::ClampToEdge } else { Wrap::Repeat });
        assert_eq!(texture.levels().len(), 2);
    }
}

#[test]
fn textures_are_read_once() {
    let text = format!("mtllib my lib.mtl\n{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    let library = "newmtl a\nmap_Kd graded.png\nnewmtl b\nmap_Kd .\\graded.png\n";
    let loaded = obj::parse(text.as_bytes(), &with_library(library)).unwrap();
    assert_eq!((loaded.scene.textures().len(), loaded.scene.materials().len()), (1, 2));
}

#[test]
fn what_cannot_be_had_is_a_warning() {
    for (library, message) in [("map_Kd missing.png", "'missing.png'"), ("map_d broken.png", "'broken.png' is neither")]
    {
        let (loaded, material) = try_material(library).unwrap();
        assert!(material.texture.is_none());
        assert_eq!(loaded.warnings.len(), 1);
        assert!(loaded.warnings[0].contains(message), "{:?}", loaded.warnings);
    }
    let loaded = load(format!("mtllib a.mtl\n{SQUARE}usemtl a\nf 1 2 3\n"));
    assert_eq!(loaded.scene.materials()[0].base_color, Vec4::ONE);
    let [library, material] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(library.contains("'a.mtl'") && material.contains("material 'a'"), "{library} {material}");
}

#[test]
fn names_that_lead_out_of_the_folder_are_errors() {
    for library in ["map_Kd ../secret.png", "map_d a/../../secret.png"] {
        assert!(matches!(try_material(library), Err(LoadError::OutsideFolder { .. })), "{library}");
    }
    let text = format!("mtllib ../secret.mtl\n{SQUARE}f 1 2 3\n");
    let error = obj::parse(text.as_bytes(), &with_library("")).unwrap_err();
    assert!(error.to_string().contains("'../secret.mtl'"), "{error}");
    // The same with real files.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.obj");
    std::fs::write(&file, text).unwrap();
    assert!(load_file(&file).unwrap_err().to_string().contains("secret.mtl"));
}

#[test]
fn errors_say_where() {
    let parse = obj::parse;
    assert!(error(parse, "").contains("empty"));
    assert!(error(parse, SQUARE).contains("no faces"));
    let broken = |line: &str| error(parse, format!("{SQUARE}{line}\nf 1 2 3\n"));
    for (line, message) in [
        ("v 1 2", "line 5: a number is missing in a vertex"),
        ("v 1 2 three", "line 5: 'three' in a vertex is no number"),
        ("v 1 2 3 4 5 six", "line 5: 'six'"),
        ("vn 1 2", "line 5: a number is missing in a normal"),
        ("vt", "line 5: a number is missing in a texture coordinate"),
        ("vt 1 x", "line 5: 'x'"),
        ("s many", "line 5: 'many' is no smoothing group"),
        ("f 1 2", "line 5: a face of 2 corners"),
        ("f 1 2 5", "line 5: vertex 5 is named, but there are 4 so far"),
        ("f 1 2 -5", "line 5: vertex -5"),
        ("f 1 2 0", "line 5: vertex 0"),
        ("f 1 2 99999999999999999999", "line 5: '99999999999999999999' is no number"),
        ("f 1 2 3.5", "line 5: '3.5' is no number of a vertex"),
        ("f 1/1 2/1 3/1", "line 5: texture coordinate 1 is named, but there are 0"),
        ("f 1//1 2//1 3//1", "line 5: normal 1"),
        ("f 1/// 2 3", "line 5: '1///' is no corner"),
        ("f /1 2 3", "line 5: '/1' is no corner"),
    ] {
        let found = broken(line);
        assert!(found.contains(message), "{line}: {found}");
    }
    let Err(error) = try_material("Kd one two three") else { panic!() };
    assert!(error.to_string().contains("'my lib.mtl': not a valid MTL file: line 2"), "{error}");
}

#[test]
fn coordinates_may_be_no_numbers() {
    let mesh = mesh("v nan 0 0\nv 1 inf 0\nv -infinity 1 0\nv 0 0 0\nf 1 2 3 4\n");
    assert!(mesh.positions()[0].x.is_nan());
    assert_eq!(mesh.triangles().len(), 2);
}

const WITH_EVERYTHING: &str = "mtllib my lib.mtl\nv 0 0 0\nv 1 0 0 1 0 1\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1 0\nvn 0 0 1\n\
    usemtl a material\ng g\ns 1\nf 1/1/1 2/2/1 3/1/1 -1/-1/-1\ns off\nf 1 2 \\\n3\nf 1//1 2//1 3//1 # end\n";
const LIBRARY: &str = "newmtl a material\nKd 1 0.5 0\nd 0.5\nTr 1\nmap_Kd -s 1 2 -o 0.5 opaque.png\nmap_d grey.png\n";

#[test]
fn beginnings_of_files_do_no_harm() {
    let whole = every_prefix(obj::parse, WITH_EVERYTHING.as_bytes(), &with_library(LIBRARY));
    assert!(whole > 0, "the first face alone is a file");
    for length in 0..LIBRARY.len() {
        let _ = obj::parse(WITH_EVERYTHING.as_bytes(), &with_library(&LIBRARY[..length]));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_do_no_harm(
        in_library: bool, changes in prop::collection::vec((any::<usize>(), any::<u8>()), 1..8), length in 0_usize..1000,
    ) {
        let (mut text, mut library) = (WITH_EVERYTHING.as_bytes().to_vec(), LIBRARY.as_bytes().to_vec());
        let part = if in_library { &mut library } else { &mut text };
        *part = damaged(part, &changes, length);
        let mut files = with_library("");
        files.0.insert("my lib.mtl", library);
        let _ = obj::parse(&text, &files);
    }
}

#[test]
fn real_files_have_their_triangles() {
    if let Some(file) = scene_file("utah_teapot/teapot.obj") {
        let loaded = load_file(&file).unwrap();
        assert_eq!(loaded.warnings, [""; 0]);
        assert_eq!(loaded.scene.primitive_count(), 15_704);
        assert_eq!(loaded.scene.textures().len(), 1);
    }
    if let Some(file) = scene_file("scrub_pine/scrubPine.obj") {
        let loaded = load_file(&file).unwrap();
        assert_eq!(loaded.warnings, [""; 0]);
        assert_eq!(loaded.scene.primitive_count(), 527);
        let modes: Vec<_> = loaded.scene.materials().iter().map(|m| (m.name.as_str(), m.alpha_mode)).collect();
        // A sixth of the needles' texels is half there.
        assert_eq!(modes, [("SoftPineBark", AlphaMode::Opaque), ("SoftPine2", AlphaMode::Blend)]);
    }
}
