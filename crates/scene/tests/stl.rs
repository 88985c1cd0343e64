//! The STL loader.

mod common;

use common::{damaged, error, every_prefix};
use glam::Vec3;
use pellucid_scene::{NoAssets, stl};
use proptest::prelude::*;

const TEXT: &str = "solid a name with endsolid in it\n\
    facet normal 0 0 0\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n vertex 0 1 0\n endloop\n endfacet\n\
    FACET NORMAL nan nan -nan(ind)\r\n OUTER LOOP\r\n VERTEX 0 0 1\r\n VERTEX 1e0 0 1\r\n vertex 0 .5 1\r\n ENDLOOP\r\n\
    ENDFACET\r\nendsolid a name\n";

fn binary(header: &[u8], triangles: &[[Vec3; 3]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        let corners = triangle.iter().flat_map(|v| v.to_array());
        bytes.extend([0.0; 3].into_iter().chain(corners).flat_map(f32::to_le_bytes));
        bytes.extend([0x12, 0x34]);
    }
    bytes
}

fn two_triangles() -> Vec<u8> {
    binary(b"made by hand", &[[Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::Z, Vec3::X, Vec3::Y]])
}

#[test]
fn text_gives_flat_triangles() {
    let loaded = stl::parse(TEXT.as_bytes(), &NoAssets).unwrap();
    assert_eq!(loaded.warnings, [""; 0]);
    let mesh = &loaded.scene.meshes()[0];
    assert_eq!(mesh.triangles(), [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(mesh.positions()[5], Vec3::new(0.0, 0.5, 1.0));
    assert!(mesh.normals().is_none());
    assert!(loaded.scene.materials()[0].double_sided);
}

#[test]
fn several_solids_are_one_mesh() {
    let loaded = stl::parse([TEXT, TEXT].concat().as_bytes(), &NoAssets).unwrap();
    assert_eq!(loaded.scene.primitive_count(), 4);
}

#[test]
fn binary_gives_the_same() {
    let loaded = stl::parse(&two_triangles(), &NoAssets).unwrap();
    let mesh = &loaded.scene.meshes()[0];
    assert_eq!(mesh.triangles(), [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(mesh.positions(), [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::X, Vec3::Y]);
}

#[test]
fn binary_that_begins_with_solid_is_still_binary() {
    let bytes = binary(b"solid by a careless exporter", &[[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    assert_eq!(stl::parse(&bytes, &NoAssets).unwrap().scene.primitive_count(), 1);
    // Bytes after the last triangle do no harm to a file that does not begin so.
    let mut padded = two_triangles();
    padded.extend(b"padding");
    assert_eq!(stl::parse(&padded, &NoAssets).unwrap().scene.primitive_count(), 2);
}

#[test]
fn coordinates_may_be_no_numbers() {
    let bytes = binary(b"", &[[Vec3::NAN, Vec3::X, Vec3::splat(f32::INFINITY)]]);
    assert!(stl::parse(&bytes, &NoAssets).unwrap().scene.meshes()[0].positions()[0].is_nan());
    let text = TEXT.replace("vertex 0 0 0", "vertex nan -inf 0");
    assert!(stl::parse(text.as_bytes(), &NoAssets).is_ok());
}

#[test]
fn errors_say_where() {
    let parse = stl::parse;
    assert!(error(parse, "").contains("empty"));
    assert!(error(parse, "solid nothing\nendsolid").contains("no triangles"));
    assert!(error(parse, binary(b"", &[])).contains("no triangles"));
    assert!(error(parse, "nonsense").contains("8 bytes"));
    assert!(error(parse, TEXT.replace("vertex 1 0 0", "vertex 1 0 x")).contains("line 5: 'x'"));
    assert!(error(parse, TEXT.replace("vertex 1 0 0", "vertex 1 0")).contains("line 5"));
    assert!(error(parse, TEXT.replace("vertex 1 0 0\n", "\n")).contains("line 8: a facet of 2"));
    assert!(error(parse, TEXT.replace("vertex 1 0 0", "vertex 1 0 0 0")).contains("line 5: '0'"));
    assert!(error(parse, TEXT.replacen("endfacet", "", 1)).contains("line 9: 'FACET'"));
    assert!(error(parse, &TEXT[..TEXT.rfind("ENDFACET").unwrap()]).contains("ends inside a facet"));
}

#[test]
fn a_count_beyond_the_bytes_is_refused() {
    let mut bytes = two_triangles();
    bytes[80..84].fill(0xff);
    assert!(error(stl::parse, &bytes).contains(&format!("byte {}", 84 + 50 * u64::from(u32::MAX))));
    bytes[..5].copy_from_slice(b"solid");
    bytes[5..10].fill(0);
    assert!(error(stl::parse, &bytes).contains("would end at byte"));
}

#[test]
fn beginnings_of_files_are_errors_or_fewer_triangles() {
    assert_eq!(every_prefix(stl::parse, &two_triangles(), &NoAssets), 0);
    let whole = every_prefix(stl::parse, TEXT.as_bytes(), &NoAssets);
    assert!(whole > 0, "the first facet alone is a file");
    let first = TEXT.find("FACET").unwrap();
    let cut = stl::parse(&TEXT.as_bytes()[..first], &NoAssets).unwrap();
    assert_eq!(cut.scene.primitive_count(), 1);
    assert!(cut.warnings[0].contains("endsolid"), "{:?}", cut.warnings);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_do_no_harm(
        text: bool, changes in prop::collection::vec((any::<usize>(), any::<u8>()), 1..8), length in 0_usize..1000,
    ) {
        let file = if text { TEXT.as_bytes().to_vec() } else { two_triangles() };
        let _ = stl::parse(&damaged(&file, &changes, length), &NoAssets);
    }
}
