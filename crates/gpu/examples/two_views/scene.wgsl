// A floor, panes and spheres out of nothing but numbers, and how they look from the camera and to the light.

struct View {
    clip_from_world: mat4x4<f32>,
    world_from_clip: mat4x4<f32>,
    // Where rays come from: a point if w is 1, a direction if it is 0.
    eye: vec4<f32>,
    // Towards the light.
    light: vec4<f32>,
}
@group(1) @binding(0) var<uniform> view: View;

const PI: f32 = 3.14159265;
// Steps round a sphere, and from pole to pole.
const ROUND: u32 = 128u;
const DOWN: u32 = 64u;

struct Thing {
    center: vec3<f32>,
    // Of a sphere; of a pane, half its width.
    radius: f32,
    tint: vec3<f32>,
    alpha: f32,
}

const QUADS: u32 = 3u;
const things = array(
    Thing(vec3(0.0, 0.0, 0.0), 30.0, vec3(0.66, 0.65, 0.63), 1.0),
    Thing(vec3(-2.55, 1.15, -1.3), 1.15, vec3(1.0, 0.62, 0.08), 0.45),
    Thing(vec3(2.75, 0.95, -1.55), 0.95, vec3(0.25, 0.8, 0.35), 0.45),
    Thing(vec3(0.0, 1.25, -0.45), 1.25, vec3(0.12, 0.42, 0.95), 0.3),
    Thing(vec3(-0.1, 0.95, -0.35), 0.55, vec3(0.98, 0.75, 0.15), 0.4),
    Thing(vec3(-1.75, 0.7, 0.95), 0.7, vec3(0.95, 0.13, 0.16), 0.35),
    Thing(vec3(1.65, 0.8, 0.75), 0.8, vec3(0.55, 0.16, 0.85), 0.35),
    Thing(vec3(2.3, 0.4, 2.0), 0.4, vec3(0.1, 0.75, 0.7), 0.35),
    Thing(vec3(0.25, 0.45, 1.75), 0.45, vec3(0.98, 0.35, 0.6), 0.35),
);

struct Surface {
    @builtin(position) at: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) @interpolate(flat) number: u32,
}

@vertex
fn vertex(@builtin(vertex_index) v: u32, @builtin(instance_index) number: u32) -> Surface {
    var all_things = things;
    let thing = all_things[number];
    // The two triangles of a square.
    let corner = vec2((0x32u >> (v % 6u)) & 1u, (0x2cu >> (v % 6u)) & 1u);
    var world = thing.center;
    var normal = vec3(0.0, 1.0, 0.0);
    if number == 0u {
        let across = (vec2<f32>(corner) * 2.0 - 1.0) * thing.radius;
        world += vec3(across.x, 0.0, across.y);
    } else if number < QUADS {
        let across = (vec2<f32>(corner) * 2.0 - 1.0) * thing.radius;
        let angle = select(-0.5, 0.55, number == 1u);
        world += vec3(cos(angle) * across.x, across.y, -sin(angle) * across.x);
        normal = vec3(sin(angle), 0.0, cos(angle));
    } else {
        let cell = v / 6u;
        let angles = vec2<f32>(vec2(cell % ROUND, cell / ROUND) + corner) / vec2(f32(ROUND), f32(DOWN)) * vec2(2.0, 1.0) * PI;
        normal = vec3(sin(angles.y) * cos(angles.x), cos(angles.y), sin(angles.y) * sin(angles.x));
        world += normal * thing.radius;
    }
    return Surface(view.clip_from_world * vec4(world, 1.0), world, normal, number);
}

// Cosine between a surface and the ray to where this view looks from.
fn facing(in: Surface) -> f32 {
    return abs(dot(normalize(in.normal), normalize(view.eye.xyz - in.world * view.eye.w)));
}
