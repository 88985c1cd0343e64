// Pass 3: both, through the glass, which is dull in its pits.

fn shade(fragment: Fragment) -> vec4<f32> {
    let pit = surface_load(fragment, 0u).w;
    let refracted = light_load(fragment, 0u);
    let reflected = light_load(fragment, 1u);
    let tint = vec3(0.72, 0.88, 0.86) * (1.0 - 0.5 * pit);
    let alpha = max(0.3 + 0.4 * pit, reflected.w);
    return vec4(refracted.xyz * tint * refracted.w * alpha + reflected.xyz * reflected.w, alpha);
}
