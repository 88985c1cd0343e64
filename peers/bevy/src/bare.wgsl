// One colour, into the picture or into Bevy's linked lists.

#import bevy_pbr::forward_io::VertexOutput
#ifdef OIT_ENABLED
#import bevy_core_pipeline::oit::oit_draw
#endif

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> color: vec4<f32>;

@fragment
fn fragment(in: VertexOutput) -> @location(0) vec4<f32> {
#ifdef OIT_ENABLED
    oit_draw(in.position, color);
    discard;
#endif
    return color;
}
