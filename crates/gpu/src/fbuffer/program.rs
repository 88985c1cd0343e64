//! A shader of several passes, as text. Twin: `shaders/fbuffer/module.wesl`.

use std::fmt::Write;

use wgpu::{BindGroupLayout, ComputePipeline};

use super::{FBuffer, FBufferError, Keeping};
use crate::pass::ordered::compute_pipeline;

/// What one of a program's buffers holds for each fragment. For a buffer named `light`, passes read and write it by
///
/// - `light_load(fragment, target: u32) -> vec4<f32>` and `light_store(fragment, target, value: vec4<f32>)`, or
/// - `light_load(fragment) -> Type` and `light_store(fragment, value: Type)`.
///
/// A slot that no pass has written yet is zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content<'a> {
    /// So many RGBA targets of 32-bit floats: 1 to 4.
    Targets(u32),
    /// A structure of one's own.
    State {
        /// Its name.
        name: &'a str,
        /// Its declaration in WGSL, with whatever else it needs.
        declaration: &'a str,
        /// Bytes from one to the next, as WGSL lays out an array of it.
        stride: u32,
    },
}

impl Content<'_> {
    /// Bytes a slot.
    pub(super) fn bytes(&self) -> u64 {
        match self {
            Self::Targets(count) => u64::from(*count) * 16,
            Self::State { stride, .. } => (*stride).into(),
        }
    }

    pub(super) fn check(&self, name: &str) -> Result<(), FBufferError> {
        let reason = match self {
            _ if !is_identifier(name) => "names are ASCII letters, digits and '_', a letter first",
            Self::Targets(0 | 5..) => "there are 1 to 4 targets",
            Self::State { name, .. } if !is_identifier(name) => "the name of its type is none in WGSL",
            Self::State { stride, .. } if *stride == 0 || stride % 4 != 0 => "a stride is a multiple of 4 bytes",
            _ => return Ok(()),
        };
        Err(FBufferError::Buffer { name: name.to_owned(), reason })
    }

    /// The functions that passes read and write it by.
    pub(super) fn wgsl(&self, name: &str, binding: u32) -> String {
        let mut text = String::new();
        let slots = format!("@group(3) @binding({binding}) var<storage, read_write> {name}_slots");
        let written = match self {
            Self::Targets(count) => write!(
                text,
                "{slots}: array<vec4<f32>>;
                fn {name}_load(fragment: Fragment, number: u32) -> vec4<f32> {{
                    return {name}_slots[fbuffer_address(fragment) * {count}u + min(number, {count}u - 1u)];
                }}
                fn {name}_store(fragment: Fragment, number: u32, value: vec4<f32>) {{
                    if fbuffer_keeps(fragment) {{
                        {name}_slots[fbuffer_address(fragment) * {count}u + min(number, {count}u - 1u)] = value;
                    }}
                }}\n"
            ),
            Self::State { name: ty, declaration, .. } => write!(
                text,
                "{declaration}
                {slots}: array<{ty}>;
                fn {name}_load(fragment: Fragment) -> {ty} {{ return {name}_slots[fbuffer_address(fragment)]; }}
                fn {name}_store(fragment: Fragment, value: {ty}) {{
                    if fbuffer_keeps(fragment) {{ {name}_slots[fbuffer_address(fragment)] = value; }}
                }}\n"
            ),
        };
        debug_assert!(written.is_ok(), "strings take all");
        text
    }
}

fn is_identifier(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// The pipelines of a shader's passes.
#[derive(Debug)]
pub struct Program {
    pub(super) pipelines: Vec<ComputePipeline>,
    /// Where their intermediate results are.
    pub(super) keeping: Keeping,
}

const ENTRY: &str = "fbuffer_pass";

impl FBuffer {
    /// A shader of so many passes, each a text in WGSL with a function `shade`, and whatever else it needs:
    ///
    /// - `fn shade(fragment: Fragment)` in all but the last,
    /// - `fn shade(fragment: Fragment) -> vec4<f32>` in the last: linear light, premultiplied alpha.
    ///
    /// A `Fragment` knows its `slot`, `pixel`, `depth`, `draw`, `triangle`, and the perspective-correct `weights` of its
    /// triangle's vertices. `fbuffer_kill(fragment)` ends one: later passes do not see it. Bind groups 0 to 2 are yours.
    ///
    /// # Errors
    /// [`FBufferError::Pass`] with what the compiler says.
    pub fn program(
        &self,
        passes: &[&str],
        own_layouts: [Option<&BindGroupLayout>; 3],
    ) -> Result<Program, FBufferError> {
        let [a, b, c] = own_layouts;
        let layouts = [a, b, c, Some(&self.layout)];
        let Some(last) = passes.len().checked_sub(1) else { return Err(FBufferError::NoPasses) };
        let pipeline = |(i, &pass): (usize, &&str)| {
            let body = if i == last { "fbuffer_finish(fragment, shade(fragment));" } else { "shade(fragment);" };
            let text = format!(
                "{}\n{}\n{pass}
                @compute @workgroup_size(fbuffer_lanes)
                fn {ENTRY}(
                    @builtin(workgroup_id) group: vec3<u32>,
                    @builtin(num_workgroups) groups: vec3<u32>,
                    @builtin(local_invocation_index) lane: u32,
                ) {{
                    let fragment = fbuffer_fragment(group, groups, lane, {});
                    if fragment.is_there {{ {body} }}
                }}",
                self.keeping.module(),
                self.buffers_wgsl(),
                i == last,
            );
            let device = &self.gpu.device;
            let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(ENTRY),
                source: wgpu::ShaderSource::Wgsl(text.into()),
            });
            let pipeline = compute_pipeline(&self.gpu, ENTRY, &module, ENTRY, &layouts, &[]);
            match pollster::block_on(scope.pop()) {
                None => Ok(pipeline),
                Some(error) => Err(FBufferError::Pass { number: i + 1, detail: error.to_string() }),
            }
        };
        let pipelines = passes.iter().enumerate().map(pipeline).collect::<Result<_, _>>()?;
        Ok(Program { pipelines, keeping: self.keeping })
    }
}

impl Program {
    /// Its number of passes.
    pub fn pass_count(&self) -> u64 {
        self.pipelines.len() as u64
    }
}
