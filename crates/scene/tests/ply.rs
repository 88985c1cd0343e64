//! The PLY loader.

mod common;

use common::{damaged, error, every_prefix, scene_file};
use glam::{Vec2, Vec3, Vec4};
use pellucid_core::{AlphaMode, Mesh, color};
use pellucid_scene::{Loaded, NoAssets, load_file, ply};
use proptest::prelude::*;

/// A number of a body, to be written in any encoding.
#[derive(Clone, Copy)]
enum N {
    U8(u8),
    I32(i32),
    F32(f32),
    F64(f64),
    /// A line ends here in ascii.
    End,
}
use N::{End, F32, F64, I32, U8};

const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

fn write(encoding: &str, header: &str, body: &[N]) -> Vec<u8> {
    let mut bytes = format!("ply\nformat {encoding} 1.0\ncomment by hand\n{header}end_header\n").into_bytes();
    for &number in body {
        let (text, little): (_, Vec<u8>) = match number {
            U8(n) => (n.to_string(), n.to_le_bytes().into()),
            I32(n) => (n.to_string(), n.to_le_bytes().into()),
            F32(n) => (n.to_string(), n.to_le_bytes().into()),
            F64(n) => (n.to_string(), n.to_le_bytes().into()),
            End => (String::new(), Vec::new()),
        };
        match (encoding, number) {
            ("ascii", End) => bytes.push(b'\n'),
            ("ascii", _) => bytes.extend(format!("{text} ").into_bytes()),
            ("binary_little_endian", _) => bytes.extend(little),
            _ => bytes.extend(little.into_iter().rev()),
        }
    }
    bytes
}

const SQUARE_VERTICES: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const SQUARE: [N; 16] = [
    F32(0.0),
    F32(0.0),
    F32(0.0),
    End,
    F32(1.0),
    F32(0.0),
    F32(0.0),
    End,
    F32(1.0),
    F32(1.0),
    F32(0.0),
    End,
    F32(0.0),
    F32(1.0),
    F32(0.0),
    End,
];

fn square_with(header: &str, body: &[N]) -> [Vec<u8>; 3] {
    ENCODINGS
        .map(|encoding| write(encoding, &format!("{SQUARE_VERTICES}{header}"), &[SQUARE.as_slice(), body].concat()))
}

fn square() -> [Vec<u8>; 3] {
    let faces = "element face 2\nproperty list uchar int vertex_indices\n";
    square_with(faces, &[U8(3), I32(0), I32(1), I32(2), End, U8(3), I32(0), I32(2), I32(3), End])
}

fn load(bytes: &[u8]) -> Loaded {
    ply::parse(bytes, &NoAssets).unwrap()
}

fn mesh(loaded: &Loaded) -> &Mesh {
    &loaded.scene.meshes()[0]
}

#[test]
fn all_encodings_give_the_same_mesh() {
    for bytes in square() {
        let loaded = load(&bytes);
        assert_eq!(loaded.warnings, [""; 0]);
        assert_eq!(mesh(&loaded).triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh(&loaded).positions()[2], Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(mesh(&loaded).normals().unwrap(), [Vec3::Z; 4]);
        assert_eq!(loaded.scene.materials()[0].alpha_mode, AlphaMode::Opaque);
    }
}

#[test]
fn every_type_of_number_is_read() {
    let header = "element vertex 3\n\
        property int8 a\nproperty uint8 b\nproperty int16 c\nproperty uint16 d\nproperty int32 e\nproperty uint32 f\n\
        property float64 x\nproperty double y\nproperty float32 z\n\
        element face 1\nproperty list ushort ushort skipped\nproperty list int short vertex_index\nproperty char flag\n";
    for encoding in &ENCODINGS[1..] {
        let mut bytes = write(encoding, header, &[]);
        let big = encoding.contains("big");
        let mut push = |little: &[u8]| {
            let mut number = little.to_vec();
            if big {
                number.reverse();
            }
            bytes.extend(number);
        };
        for corner in 0..3_u8 {
            push(&[0xff]);
            push(&[0xff]);
            push(&(-2_i16).to_le_bytes());
            push(&40_000_u16.to_le_bytes());
            push(&(-3_i32).to_le_bytes());
            push(&4_000_000_000_u32.to_le_bytes());
            push(&(f64::from(corner) + 0.5).to_le_bytes());
            push(&f64::from(corner * corner).to_le_bytes());
            push(&7.0_f32.to_le_bytes());
        }
        for number in [2_u16, 9, 9] {
            push(&number.to_le_bytes());
        }
        push(&3_i32.to_le_bytes());
        for index in [2_i16, 1, 0] {
            push(&index.to_le_bytes());
        }
        push(&[0x80]);
        let loaded = load(&bytes);
        assert_eq!(mesh(&loaded).triangles(), [[2, 1, 0]]);
        assert_eq!(mesh(&loaded).positions()[2], Vec3::new(2.5, 4.0, 7.0));
    }
}

#[test]
fn polygons_are_cut() {
    let faces = "element face 3\nproperty list uchar int vertex_indices\n";
    let body =
        [U8(4), I32(0), I32(1), I32(2), I32(3), End, U8(2), I32(0), I32(1), End, U8(3), I32(3), I32(1), I32(0), End];
    for bytes in square_with(faces, &body) {
        let loaded = load(&bytes);
        assert_eq!(mesh(&loaded).triangles(), [[0, 1, 2], [0, 2, 3], [3, 1, 0]]);
        assert_eq!(loaded.warnings.len(), 1);
        assert!(loaded.warnings[0].contains("fewer than 3"));
    }
}

#[test]
fn strips_turn_every_other_triangle() {
    let strips = "element tristrips 1\nproperty list int int vertex_indices\n";
    let body = [I32(9), I32(0), I32(1), I32(3), I32(2), I32(-1), I32(1), I32(2), I32(2), I32(3), End];
    for bytes in square_with(strips, &body) {
        let loaded = load(&bytes);
        // In the second strip, the repeated vertex moves it along by one.
        assert_eq!(mesh(&loaded).triangles(), [[0, 1, 3], [3, 1, 2]]);
        assert_eq!(mesh(&loaded).normals().unwrap(), [Vec3::Z; 4]);
    }
}

#[test]
fn faces_may_come_before_vertices() {
    let header = format!("element face 1\nproperty list uchar int vertex_indices\n{SQUARE_VERTICES}");
    let body = [[U8(4), I32(0), I32(1), I32(2), I32(3), End].as_slice(), &SQUARE].concat();
    for encoding in ENCODINGS {
        assert_eq!(load(&write(encoding, &header, &body)).scene.primitive_count(), 2);
    }
}

fn triangle_with(properties: &str, values: &[N]) -> Loaded {
    let header = format!(
        "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n{properties}\
         element face 1\nproperty list uchar int vertex_indices\n"
    );
    let mut body = Vec::new();
    for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
        body.extend([F32(x), F32(y), F32(0.0)]);
        body.extend(values);
        body.push(End);
    }
    body.extend([U8(3), I32(0), I32(1), I32(2), End]);
    let [ascii, little, big] = ENCODINGS.map(|encoding| load(&write(encoding, &header, &body)));
    assert_eq!(ascii.scene.meshes()[0].colors(), little.scene.meshes()[0].colors());
    assert_eq!(big.scene.meshes()[0].colors(), little.scene.meshes()[0].colors());
    little
}

#[test]
fn colours_of_vertices_are_linear_light() {
    let bytes = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let loaded = triangle_with(bytes, &[U8(255), U8(188), U8(0)]);
    assert_eq!(mesh(&loaded).colors().unwrap()[1], Vec4::new(1.0, color::linear_from_srgb8(188), 0.0, 1.0));
    assert_eq!(loaded.scene.materials()[0].alpha_mode, AlphaMode::Opaque);

    let floats = "property float diffuse_red\nproperty float diffuse_green\nproperty double diffuse_blue\n";
    let loaded = triangle_with(floats, &[F32(0.5), F32(f32::NAN), F64(2.0)]);
    assert_eq!(mesh(&loaded).colors().unwrap()[1], Vec4::new(0.5, 0.0, 1.0, 1.0));
}

#[test]
fn alpha_makes_the_surface_transparent() {
    let properties = "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
    let loaded = triangle_with(properties, &[U8(255), U8(255), U8(255), U8(51)]);
    assert_eq!(mesh(&loaded).colors().unwrap()[0], Vec4::new(1.0, 1.0, 1.0, 0.2));
    assert_eq!(loaded.scene.materials()[0].alpha_mode, AlphaMode::Blend);
    let opaque = triangle_with(properties, &[U8(1), U8(2), U8(3), U8(255)]);
    assert_eq!(opaque.scene.materials()[0].alpha_mode, AlphaMode::Opaque);
}

#[test]
fn normals_and_texture_coordinates_are_kept() {
    let properties = "property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n";
    let loaded = triangle_with(properties, &[F32(0.0), F32(2.0), F32(0.0), F32(0.25), F32(0.75)]);
    assert_eq!(mesh(&loaded).normals().unwrap()[0], Vec3::new(0.0, 2.0, 0.0));
    assert_eq!(mesh(&loaded).tex_coords().unwrap()[2], Vec2::new(0.25, 0.25));
    // A normal that points nowhere is made anew.
    let zero = triangle_with(properties, &[F32(0.0), F32(0.0), F32(0.0), F32(0.0), F32(0.0)]);
    assert_eq!(mesh(&zero).normals().unwrap()[0], Vec3::Z);
}

#[test]
fn unknown_elements_and_properties_are_skipped() {
    let header = "element edge 2\nproperty list uchar float odd\nproperty int c\nelement nothing 1000000000\n\
        element face 1\nproperty uchar red\nproperty list uchar int vertex_indices\nproperty list int double more\n";
    let body = [
        U8(2),
        F32(1.0),
        F32(2.0),
        I32(7),
        End,
        U8(0),
        I32(8),
        End,
        U8(9),
        U8(3),
        I32(1),
        I32(2),
        I32(3),
        I32(1),
        F64(0.5),
        End,
    ];
    for bytes in square_with(header, &body) {
        let loaded = load(&bytes);
        assert_eq!(mesh(&loaded).triangles(), [[1, 2, 3]]);
        assert!(loaded.warnings[0].contains("colours of faces"), "{:?}", loaded.warnings);
    }
}

#[test]
fn lines_may_end_in_any_way() {
    let [ascii, little, _] = square();
    for end in ["\r\n", "\r"] {
        let text = String::from_utf8(ascii.clone()).unwrap().replace('\n', end);
        assert_eq!(load(text.as_bytes()).scene.primitive_count(), 2);
        let body = little.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let mut bytes = String::from_utf8(little[..body].to_vec()).unwrap().replace('\n', end).into_bytes();
        let body_start = bytes.len();
        bytes.extend(&little[body..]);
        assert_eq!(load(&bytes).scene.primitive_count(), 2);
        // The first byte of data looks like the second half of a line end.
        bytes[body_start] = b'\n';
        assert_eq!(mesh(&load(&bytes)).positions()[0].x, f32::from_bits(10));
    }
}

#[test]
fn coordinates_may_be_no_numbers() {
    let mut body = SQUARE.to_vec();
    (body[0], body[1]) = (F32(f32::NAN), F32(f32::NEG_INFINITY));
    body.extend([U8(4), I32(0), I32(1), I32(2), I32(3), End]);
    let header = format!("{SQUARE_VERTICES}element face 1\nproperty list uchar int vertex_indices\n");
    for encoding in ENCODINGS {
        assert!(mesh(&load(&write(encoding, &header, &body))).positions()[0].x.is_nan());
    }
}

#[test]
fn errors_in_the_header_say_where() {
    let parse = ply::parse;
    let broken = |from: &str, to: &str| {
        let text = String::from_utf8(square()[0].clone()).unwrap();
        assert!(text.contains(from));
        error(parse, text.replacen(from, to, 1))
    };
    assert!(error(parse, "").contains("empty"));
    assert!(error(parse, "plyx\n").contains("does not begin"));
    assert!(error(parse, "ply\nformat ascii 1.0\n").contains("end_header"));
    assert!(broken("format ascii", "format morse").contains("line 2: unknown encoding 'morse'"));
    assert!(broken("ascii 1.0", "ascii 2.0").contains("line 2: version '2.0'"));
    assert!(broken("format ascii 1.0", "").contains("no line 'format'"));
    assert!(broken("comment", "remark").contains("line 3: 'remark'"));
    assert!(broken("vertex 4", "vertex four").contains("line 4: 'four'"));
    assert!(broken("vertex 4", "vertex -4").contains("line 4: '-4'"));
    assert!(broken("element vertex 4", "").contains("line 5: a property before"));
    assert!(broken("float y", "half y").contains("line 6: unknown type 'half'"));
    assert!(broken("float y", "float q").contains("lacks x, y or z"));
    assert!(broken("float y", "float").contains("line 6"));
    assert!(broken("uchar int", "float int").contains("line 9: the length of a list"));
    assert!(broken("vertex_indices", "corners").contains("no list 'vertex_indices'"));
    assert!(broken("element face", "element vertex").contains("line 8: element 'vertex' is there twice"));
}

#[test]
fn errors_in_the_rows_say_where() {
    let text = String::from_utf8(square()[0].clone()).unwrap();
    let broken = |from: &str, to: &str| {
        assert!(text.contains(from));
        error(ply::parse, text.replacen(from, to, 1))
    };
    assert!(broken("1 1 0 \n", "1 one 0 \n").contains("line 13: 'one'"));
    assert!(broken("1 1 0 \n", "1 1 \n").contains("line 13: the row has too few"));
    assert!(broken("1 1 0 \n", "1 1 0 0\n").contains("line 13: '0' is one word too many"));
    assert!(broken("3 0 1 2", "3 0 1 4").contains("line 15: vertex 4 is named, but there are 4"));
    assert!(broken("3 0 1 2", "3 0 1 -1").contains("line 15: vertex -1"));
    assert!(broken("3 0 1 2", "3 0 1 1.5").contains("line 15: '1.5' is no whole number"));
    assert!(broken("3 0 1 2", "-3 0 1 2").contains("line 15: a list cannot have -3"));
    assert!(broken("3 0 1 2", "255 0 1 2").contains("line 15: a list of 255 items"));
    assert!(broken("3 0 2 3 \n", "").contains("line 15: the file ends"));
    let [_, little, big] = square();
    for mut bytes in [little, big] {
        let last = bytes.len() - 26;
        bytes[last] = 200;
        let message = error(ply::parse, &bytes);
        assert!(message.contains("row 1 of element 'face': a list of 200"), "{message}");
        assert!(message.contains(&format!("byte {}", last + 1)), "{message}");
    }
}

#[test]
fn point_clouds_and_empty_files_are_refused() {
    for bytes in square_with("", &[]) {
        assert!(error(ply::parse, &bytes).contains("point clouds"));
    }
    for bytes in square_with("element face 0\nproperty list uchar int vertex_indices\n", &[]) {
        assert!(error(ply::parse, &bytes).contains("point clouds"));
    }
    assert!(error(ply::parse, "ply\nformat ascii 1.0\nend_header\n").contains("no element 'vertex'"));
}

#[test]
fn counts_beyond_the_bytes_are_refused() {
    for count in ["4000000000", "18446744073709551615"] {
        for name in ["vertex", "face", "other"] {
            for encoding in ENCODINGS {
                let header = ["vertex", "other", "face"]
                    .map(|element| {
                        let count = if element == name { count } else { "1" };
                        let list = if element == "face" { "property list uchar int vertex_indices\n" } else { "" };
                        format!(
                            "element {element} {count}\nproperty float x\nproperty float y\nproperty float z\n{list}"
                        )
                    })
                    .concat();
                let row = [F32(0.0), F32(0.0), F32(0.0), End];
                let message = error(ply::parse, write(encoding, &header, &[row, row, row].concat()));
                assert!(message.contains("are announced") || message.contains("can be numbered"), "{message}");
            }
        }
    }
}

#[test]
fn beginnings_of_files_are_errors() {
    let [ascii, little, big] = square();
    assert_eq!(every_prefix(ply::parse, &little, &NoAssets), 0);
    assert_eq!(every_prefix(ply::parse, &big, &NoAssets), 0);
    // Only the last space and the last line end are not missed.
    assert_eq!(every_prefix(ply::parse, &ascii, &NoAssets), 2);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_do_no_harm(
        encoding in 0_usize..3, changes in prop::collection::vec((any::<usize>(), any::<u8>()), 1..8),
        length in 0_usize..1000,
    ) {
        let _ = ply::parse(&damaged(&square()[encoding], &changes, length), &NoAssets);
    }
}

#[test]
fn real_files_have_their_triangles() {
    for (name, vertices, triangles) in [
        ("stanford_dragon/dragon_871k.ply", 437_645, 871_414),
        ("stanford_dragon/dragon_48k.ply", 22_998, 47_794),
        ("stanford_bunny/bunny_144k.ply", 72_378, 144_046),
        ("stanford_bunny/bunny_69k.ply", 35_947, 69_451),
        ("sintel_hair/sintel_hair_tubes.ply", 547_200, 1_026_000),
        ("skull/skull.ply", 41_864, 74_998),
    ] {
        let Some(file) = scene_file(name) else { continue };
        let start = std::time::Instant::now();
        let loaded = load_file(&file).unwrap();
        eprintln!("{name}: {} ms", start.elapsed().as_millis());
        assert_eq!(loaded.warnings, [""; 0]);
        assert_eq!(mesh(&loaded).positions().len(), vertices, "{name}");
        assert_eq!(mesh(&loaded).triangles().len(), triangles, "{name}");
        assert_eq!(mesh(&loaded).tex_coords().is_some(), name.contains("144k"));
    }
}
