// What passes know of a scene. Twin: scene_words in gpu.rs.

// In groups of four words: the draws, then the vertices of all meshes.
@group(0) @binding(0) var<storage, read> scene_words: array<vec4<u32>>;
// Three vertices each.
@group(0) @binding(1) var<storage, read> scene_triangles: array<u32>;

struct Draw {
    // Where one looks from, in the mesh's own space.
    eye: vec3<f32>,
    opacity: f32,
    // Turns normals into camera space, up to a factor.
    view_from_normal: mat3x3<f32>,
    first_triangle: u32,
    // Among the words.
    first_vertex: u32,
    flags: u32,
    // Straight.
    color: vec4<f32>,
    cutoff: f32,
}

const LIT: u32 = 1u;
const BLENDS: u32 = 2u;
const HAS_NORMALS: u32 = 4u;
const HAS_CUTOFF: u32 = 8u;

fn draw_of(fragment: Fragment) -> Draw {
    let start = fragment.draw * 6u;
    let a = scene_words[start];
    let x = scene_words[start + 1u];
    let y = scene_words[start + 2u];
    let z = scene_words[start + 3u];
    return Draw(
        bitcast<vec3<f32>>(a.xyz),
        bitcast<f32>(a.w),
        mat3x3(bitcast<vec3<f32>>(x.xyz), bitcast<vec3<f32>>(y.xyz), bitcast<vec3<f32>>(z.xyz)),
        x.w,
        y.w,
        z.w,
        bitcast<vec4<f32>>(scene_words[start + 4u]),
        bitcast<f32>(scene_words[start + 5u].x),
    );
}

// Words of the triangle's three vertices: position, normal, colour.
fn vertices_of(fragment: Fragment, draw: Draw) -> array<u32, 3> {
    let first = (draw.first_triangle + fragment.triangle) * 3u;
    return array(
        draw.first_vertex + scene_triangles[first] * 3u,
        draw.first_vertex + scene_triangles[first + 1u] * 3u,
        draw.first_vertex + scene_triangles[first + 2u] * 3u,
    );
}

fn blended(vertices: array<u32, 3>, number: u32, weights: vec3<f32>) -> vec4<f32> {
    return bitcast<vec4<f32>>(scene_words[vertices[0] + number]) * weights.x
        + bitcast<vec4<f32>>(scene_words[vertices[1] + number]) * weights.y
        + bitcast<vec4<f32>>(scene_words[vertices[2] + number]) * weights.z;
}

// Of the triangle, from edges about 1 long, so that squares of them stay within f32 at any scale.
fn flat_normal(vertices: array<u32, 3>) -> vec3<f32> {
    let a = bitcast<vec3<f32>>(scene_words[vertices[0]].xyz);
    let b = bitcast<vec3<f32>>(scene_words[vertices[1]].xyz) - a;
    let c = bitcast<vec3<f32>>(scene_words[vertices[2]].xyz) - a;
    let greatest_b = max(max(abs(b.x), abs(b.y)), max(abs(b.z), 1.1754944e-38));
    let greatest_c = max(max(abs(c.x), abs(c.y)), max(abs(c.z), 1.1754944e-38));
    return cross(b / greatest_b, c / greatest_c);
}

fn mesh_normal(draw: Draw, vertices: array<u32, 3>, weights: vec3<f32>) -> vec3<f32> {
    if (draw.flags & HAS_NORMALS) == 0u {
        return flat_normal(vertices);
    }
    return blended(vertices, 1u, weights).xyz;
}

fn position_of(fragment: Fragment) -> vec3<f32> {
    return blended(vertices_of(fragment, draw_of(fragment)), 0u, fragment.weights).xyz;
}

fn normal_of(fragment: Fragment) -> vec3<f32> {
    let draw = draw_of(fragment);
    return normalize(mesh_normal(draw, vertices_of(fragment, draw), fragment.weights));
}

fn eye(fragment: Fragment) -> vec3<f32> {
    return draw_of(fragment).eye;
}
