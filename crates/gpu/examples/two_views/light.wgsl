// The light's LFB is a deep shadow map: what each layer lets through of red, green and blue, in one word.
@fragment
fn light(in: Surface) -> @location(0) vec4<f32> {
    var all_things = things;
    let thing = all_things[in.number];
    // The more slanting the way through the glass, the longer.
    let through = pow(mix(vec3(1.0), thing.tint, 0.85), vec3(0.55 / max(facing(in), 0.2)));
    light_add(vec2<u32>(in.at.xy), pack4x8unorm(vec4(through, 1.0)), in.at.z, in.number);
    return vec4(0.0);
}
