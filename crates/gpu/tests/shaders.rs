//! Every linked shader is valid, and lays its structs out as their twins in Rust.

use std::mem::offset_of;

use naga::valid::{Capabilities, ValidationFlags, Validator};
use pellucid_gpu::gpu_data::{AtlasPlace, DrawData};
use pellucid_gpu::shaders;

fn module(name: &str, wgsl: &str) -> naga::Module {
    naga::front::wgsl::parse_str(wgsl).unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(wgsl)))
}

#[test]
fn every_linked_shader_is_valid() {
    for (name, wgsl) in shaders::ALL {
        let module = module(name, wgsl);
        let has_subgroups = name.ends_with("_SUBGROUPS");
        let capabilities = if has_subgroups { Capabilities::SUBGROUP } else { Capabilities::empty() };
        Validator::new(ValidationFlags::all(), Capabilities::SHADER_FLOAT16_IN_FLOAT32 | capabilities)
            .subgroup_stages(naga::valid::ShaderStages::COMPUTE)
            .subgroup_operations(naga::valid::SubgroupOperationSet::all())
            .validate(&module)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(wgsl)));
    }
}

/// Offsets of a struct's members, and its size, as a linked shader has them.
fn layout(name: &str, shader: &str) -> (Vec<usize>, usize) {
    let wgsl = shaders::ALL.iter().find(|(other, _)| *other == shader).unwrap().1;
    let module = module(shader, wgsl);
    let found = module.types.iter().find_map(|(_, ty)| match &ty.inner {
        naga::TypeInner::Struct { members, span } if ty.name.as_ref()?.contains(name) => {
            Some((members.iter().map(|member| member.offset as usize).collect(), *span as usize))
        }
        _ => None,
    });
    found.unwrap_or_else(|| panic!("{name} of {shader}"))
}

#[test]
fn draws_are_laid_out_alike_one_by_one_and_in_an_array() {
    let mut expected = vec![
        offset_of!(DrawData, clip_from_mesh),
        offset_of!(DrawData, view_from_normal),
        offset_of!(DrawData, base_color),
        offset_of!(DrawData, material_color),
        offset_of!(DrawData, uv_from_tex_coord),
        offset_of!(DrawData, uv_offset),
        offset_of!(DrawData, opacity),
        offset_of!(DrawData, cutoff),
        offset_of!(DrawData, first_primitive),
        offset_of!(DrawData, first_index),
        offset_of!(DrawData, first_vertex),
        offset_of!(DrawData, normals),
        offset_of!(DrawData, tex_coords),
        offset_of!(DrawData, colors),
        offset_of!(DrawData, flags),
        offset_of!(DrawData, sampling),
        offset_of!(DrawData, texture_size),
        offset_of!(DrawData, number),
    ];
    let atlas = offset_of!(DrawData, atlas);
    expected.extend([
        atlas + offset_of!(AtlasPlace, full_size),
        atlas + offset_of!(AtlasPlace, smaller),
        atlas + offset_of!(AtlasPlace, pages),
    ]);
    for shader in ["LINEAR", "LUCID_RASTER", "LUCID_SETUP"] {
        assert_eq!(layout("DrawData", shader), (expected.clone(), size_of::<DrawData>()), "{shader}");
    }
}
