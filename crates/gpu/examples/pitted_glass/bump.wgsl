// Pass 1: the normal of a surface with pits.

fn shade(fragment: Fragment) {
    let position = position_of(fragment);
    let normal = normal_of(fragment);
    let depth = pit(position);
    const STEP = 0.01;
    let slope = vec3(
        pit(position + vec3(STEP, 0.0, 0.0)) - depth,
        pit(position + vec3(0.0, STEP, 0.0)) - depth,
        pit(position + vec3(0.0, 0.0, STEP)) - depth,
    ) / STEP;
    let bumped = normalize(normal + slope * 0.06);
    let facing = select(bumped, -bumped, dot(bumped, eye(fragment) - position) < 0.0);
    surface_store(fragment, 0u, vec4(facing, depth));
}

fn pit(position: vec3<f32>) -> f32 {
    return smoothstep(0.58, 0.78, noise(position * 7.0));
}

// Values at the corners of a lattice, blended smoothly.
fn noise(position: vec3<f32>) -> f32 {
    let cell = floor(position);
    let within = position - cell;
    let blend = within * within * (3.0 - 2.0 * within);
    var sum = 0.0;
    for (var i = 0u; i < 8u; i++) {
        let corner = vec3<f32>(vec3(i & 1u, (i >> 1u) & 1u, i >> 2u));
        let weights = mix(1.0 - blend, blend, corner);
        sum += lattice(vec3<i32>(cell + corner)) * weights.x * weights.y * weights.z;
    }
    return sum;
}

fn lattice(corner: vec3<i32>) -> f32 {
    let c = bitcast<vec3<u32>>(corner);
    var mixed = (c.x * 0x8da6b343u) ^ (c.y * 0xd8163841u) ^ (c.z * 0xcb1ab31fu);
    mixed = (mixed ^ (mixed >> 13u)) * 0x5bd1e995u;
    return f32((mixed ^ (mixed >> 15u)) >> 8u) / 16777216.0;
}
