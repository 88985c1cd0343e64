// Reads both LFBs: blends the camera's layers front to back, each in the light that the light's layers before it let
// through.

struct View {
    clip_from_world: mat4x4<f32>,
    world_from_clip: mat4x4<f32>,
    eye: vec4<f32>,
    light: vec4<f32>,
}
@group(2) @binding(0) var<uniform> from_camera: View;
@group(2) @binding(1) var<uniform> from_light: View;
@group(2) @binding(2) var<storage, read_write> picture: array<u32>;

const AMBIENT: vec3<f32> = vec3(0.26, 0.29, 0.34);
const SUN: vec3<f32> = vec3(1.0, 0.95, 0.86);
// Keeps a surface out of its own shadow; of the depth of the light's view.
const BIAS: f32 = 0.002;

@compute @workgroup_size(8, 8)
fn look(@builtin(global_invocation_id) at: vec3<u32>) {
    let size = camera_size() / 2u;
    if any(at.xy >= size) {
        return;
    }
    // Four pixels of the LFB for one of the picture.
    var color = vec3(0.0);
    for (var i = 0u; i < 4u; i++) {
        color += blended(at.xy * 2u + vec2(i & 1u, i >> 1u));
    }
    picture[at.y * size.x + at.x] = pack4x8unorm(vec4(srgb(color / 4.0), 1.0));
}

fn blended(pixel: vec2<u32>) -> vec3<f32> {
    let size = vec2<f32>(camera_size());
    let across = (vec2<f32>(pixel) + 0.5) / size * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    let sky = mix(vec3(0.55, 0.62, 0.7), vec3(0.16, 0.26, 0.42), clamp(1.4 * across.y - 0.4, 0.0, 1.0));
    let layers = camera_range(pixel);
    var color = vec3(0.0);
    var through = 1.0;
    for (var i = layers.first; i < layers.end; i++) {
        let layer = camera_at(i);
        let surface = unpack4x8unorm(layer.payload.x);
        let scattered = unpack2x16float(layer.payload.y);
        let world = from_camera.world_from_clip * vec4(across, layer.depth, 1.0);
        let place = world.xyz / world.w;
        let sun = SUN * sunlight(place);
        let lit = surface.rgb * (AMBIENT + 0.8 * scattered.x * sun);
        let haze = smoothstep(4.0, 24.0, length(place));
        color += through * (mix(lit, sky, haze) * surface.a + scattered.y * sun);
        through *= 1.0 - surface.a;
        if through < 0.002 {
            break;
        }
    }
    return color + through * sky;
}

// What reaches a point, averaged over nearby rays.
fn sunlight(world: vec3<f32>) -> vec3<f32> {
    let clip = from_light.clip_from_world * vec4(world, 1.0);
    let place = (clip.xy * vec2(0.5, -0.5) + 0.5) * vec2<f32>(light_size()) - 0.5;
    let corner = floor(place);
    let f = place - corner;
    var sum = vec3(0.0);
    for (var y = -1; y <= 2; y++) {
        for (var x = -1; x <= 2; x++) {
            let weight = kernel(f.x, x) * kernel(f.y, y);
            sum += weight * let_through(vec2<i32>(corner) + vec2(x, y), clip.z);
        }
    }
    return sum / 9.0;
}

// A box of three pixels, slid between four.
fn kernel(f: f32, i: i32) -> f32 {
    return select(select(1.0, f, i == 2), 1.0 - f, i == -1);
}

fn let_through(pixel: vec2<i32>, depth: f32) -> vec3<f32> {
    // None lie outside, and what is negative is far outside.
    let layers = light_range(vec2<u32>(pixel));
    var through = vec3(1.0);
    // No break at the first layer behind: lavapipe (Mesa 22.3) crashes on it in loops as deep as these.
    for (var i = layers.first; i < layers.end; i++) {
        let layer = light_at(i);
        through *= select(vec3(1.0), unpack4x8unorm(layer.payload).rgb, layer.depth < depth - BIAS);
    }
    return through;
}

fn srgb(linear: vec3<f32>) -> vec3<f32> {
    let held = clamp(linear, vec3(0.0), vec3(1.0));
    return select(1.055 * pow(held, vec3(1.0 / 2.4)) - 0.055, 12.92 * held, held <= vec3(0.0031308));
}
