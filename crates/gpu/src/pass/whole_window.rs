//! Passes that write every pixel of a window, drawn as one triangle into the picture. Twin:
//! `shaders/shared/whole_window.wesl`.

use wgpu::{BindGroup, BindGroupLayout, BindingType, RenderPipeline, ShaderStages};

use crate::frame::Frame;
use crate::memory::Window;
use crate::surface::shader;
use crate::{Context, GpuError};

/// Long-lived half: the shader, and group 0, the frame and the opaque surfaces.
#[derive(Debug)]
pub(crate) struct WholeWindow {
    label: &'static str,
    module: wgpu::ShaderModule,
    opaque: BindGroupLayout,
    layout: wgpu::PipelineLayout,
}

impl WholeWindow {
    /// `own_layout` is group 1.
    pub(crate) fn new(
        gpu: &Context,
        label: &'static str,
        wgsl: &'static str,
        own_layout: Option<&BindGroupLayout>,
    ) -> Self {
        let texture = |sample_type| BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform = BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let bindings = [
            uniform,
            texture(wgpu::TextureSampleType::Float { filterable: false }),
            texture(wgpu::TextureSampleType::Depth),
        ];
        let entries: Vec<_> = (0..)
            .zip(bindings)
            .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: ShaderStages::FRAGMENT,
                ty,
                count: None,
            })
            .collect();
        let opaque = gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries });
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &[Some(&opaque), own_layout],
            immediate_size: 0,
        });
        Self { label, module: shader(gpu, label, wgsl), opaque, layout }
    }

    /// A pipeline with constants of its shader set.
    pub(crate) fn pipeline(&self, gpu: &Context, constants: &[(&str, f64)]) -> RenderPipeline {
        let compilation_options = wgpu::PipelineCompilationOptions { constants, ..Default::default() };
        gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.label),
            layout: Some(&self.layout),
            vertex: wgpu::VertexState {
                module: &self.module,
                entry_point: Some("corner"),
                compilation_options: compilation_options.clone(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.module,
                entry_point: Some("main"),
                compilation_options,
                targets: &[Some(crate::frame::PICTURE_FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// Records the step over a window of the picture; `own` is group 1.
    pub(crate) fn record(
        &self,
        frame: &mut Frame<'_>,
        window: Window,
        pipeline: &RenderPipeline,
        own: Option<&BindGroup>,
    ) -> Result<(), GpuError> {
        let view = wgpu::BindingResource::TextureView;
        let resources = [
            frame.frame_data.as_entire_binding(),
            view(&frame.targets.opaque_color_view),
            view(&frame.targets.opaque_depth_view),
        ];
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let group = frame.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(self.label),
            layout: &self.opaque,
            entries: &entries,
        });
        let mut pass = frame.picture_pass(self.label, window)?;
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        if own.is_some() {
            pass.set_bind_group(1, own, &[]);
        }
        pass.draw(0..3, 0..1);
        Ok(())
    }
}
