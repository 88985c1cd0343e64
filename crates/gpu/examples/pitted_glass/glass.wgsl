// What all three passes know: the mesh, and where one looks from.

struct Vertex {
    position: vec4<f32>,
    normal: vec4<f32>,
}

// The eye, then the vertices.
@group(0) @binding(0) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(1) var<storage, read> indices: array<u32>;

fn vertex_of(fragment: Fragment, corner: u32) -> Vertex {
    return vertices[1u + indices[fragment.triangle * 3u + corner]];
}

fn position_of(fragment: Fragment) -> vec3<f32> {
    return vertex_of(fragment, 0u).position.xyz * fragment.weights.x
        + vertex_of(fragment, 1u).position.xyz * fragment.weights.y
        + vertex_of(fragment, 2u).position.xyz * fragment.weights.z;
}

fn normal_of(fragment: Fragment) -> vec3<f32> {
    return normalize(vertex_of(fragment, 0u).normal.xyz * fragment.weights.x
        + vertex_of(fragment, 1u).normal.xyz * fragment.weights.y
        + vertex_of(fragment, 2u).normal.xyz * fragment.weights.z);
}

// In the mesh's own space, which of several instances each would have another of.
fn eye(fragment: Fragment) -> vec3<f32> {
    return vertices[0].position.xyz;
}
