// Pass 2: light from behind and from in front, each with its share.

fn shade(fragment: Fragment) {
    let sight = normalize(position_of(fragment) - eye(fragment));
    let normal = surface_load(fragment, 0u).xyz;
    let cosine = clamp(-dot(sight, normal), 0.0, 1.0);
    // Schlick's approximation, for glass in air.
    let share = 0.04 + 0.96 * pow(1.0 - cosine, 5.0);
    let bent = normalize(sight + normal * (cosine * 0.35));
    light_store(fragment, 0u, vec4(environment(bent), 1.0 - share));
    light_store(fragment, 1u, vec4(environment(sight + normal * (2.0 * cosine)), share));
}

// A sky over a floor of tiles, with two lamps.
fn environment(direction: vec3<f32>) -> vec3<f32> {
    let lamps = smoothstep(0.93, 0.95, dot(direction, normalize(vec3(0.5, 0.7, 0.6))))
        + 0.6 * smoothstep(0.96, 0.98, dot(direction, normalize(vec3(-0.7, 0.4, 0.5))));
    let horizon = vec3(0.75, 0.8, 0.85);
    if direction.y >= 0.0 {
        return mix(horizon, vec3(0.12, 0.25, 0.5), sqrt(direction.y)) + vec3(4.0, 3.7, 3.2) * lamps;
    }
    let place = floor(direction.xz / max(-direction.y, 0.05) * 0.7);
    let is_dark = (i32(place.x) + i32(place.y)) % 2 != 0;
    let tile = select(vec3(0.5, 0.42, 0.33), vec3(0.12, 0.1, 0.09), is_dark);
    return mix(tile, horizon, smoothstep(-0.3, 0.0, direction.y));
}
