// The lighting model, without textures. Twins: core/src/shading.rs, and shaders/shared/shading.wesl of the GPU renderer.

struct Surface {
    // Premultiplied.
    color: vec4<f32>,
    // Whether it passes the alpha test.
    is_there: bool,
}

fn surface(fragment: Fragment) -> Surface {
    let draw = draw_of(fragment);
    let vertices = vertices_of(fragment, draw);
    var color = draw.color * blended(vertices, 2u, fragment.weights);
    let is_nan = (bitcast<vec4<u32>>(color) & vec4(0x7fffffffu)) > vec4(0x7f800000u);
    if any(is_nan) {
        color = draw.color;
    }
    color = clamp(color, vec4(0.0), vec4(65504.0));
    let is_there = (draw.flags & HAS_CUTOFF) == 0u || color.w >= draw.cutoff;
    var alpha = draw.opacity;
    if (draw.flags & BLENDS) != 0u {
        alpha *= min(color.w, 1.0);
    }
    var brightness = 1.0;
    if (draw.flags & LIT) != 0u {
        brightness = light(draw.view_from_normal * mesh_normal(draw, vertices, fragment.weights));
    }
    return Surface(vec4(color.xyz * alpha * brightness, alpha), is_there);
}

const AMBIENT: f32 = 0.25;

// A normal without direction faces the camera: neither 0, infinite nor not a number.
fn light(normal: vec3<f32>) -> f32 {
    let length = sqrt(dot(normal, normal));
    var lambert = 1.0;
    if length > 0.0 && (bitcast<u32>(length) & 0x7f800000u) != 0x7f800000u {
        lambert = abs(normal.z) / length;
    }
    return AMBIENT + (1.0 - AMBIENT) * lambert;
}
