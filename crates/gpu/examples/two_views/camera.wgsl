// One fragment shader for the counting and the capturing pass of the camera's LFB: a layer's colour, and how much light it
// would scatter and reflect if nothing stood in the way.
@fragment
fn camera(in: Surface) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(in.at.xy);
    if camera_is_counting() {
        camera_add(pixel, vec2(0u), 0.0, 0u);
        return vec4(0.0);
    }
    var all_things = things;
    let thing = all_things[in.number];
    let normal = normalize(in.normal);
    let to_eye = normalize(view.eye.xyz - in.world);
    // Glass is clearest where it is looked at head on.
    let grazing = pow(1.0 - facing(in), 3.0);
    let alpha = mix(thing.alpha, 1.0, select(0.75 * grazing, 0.0, in.number < QUADS));
    let diffuse = abs(dot(normal, view.light.xyz));
    let shine = pow(abs(dot(normal, normalize(to_eye + view.light.xyz))), 220.0);
    let specular = select(1.6 * shine, 0.0, in.number == 0u);
    let payload = vec2(pack4x8unorm(vec4(thing.tint, alpha)), pack2x16float(vec2(diffuse, specular)));
    camera_add(pixel, payload, in.at.z, in.number);
    return vec4(0.0);
}
