//! Bevy without a window, a frame at a time.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use bevy::app::{PluginsState, TerminalCtrlCHandlerPlugin};
use bevy::asset::{RenderAssetUsages, embedded_asset};
use bevy::camera::RenderTarget;
use bevy::camera::visibility::NoFrustumCulling;
use bevy::core_pipeline::oit::OrderIndependentTransparencySettings;
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::mesh::{Indices, MeshVertexBufferLayoutRef, PrimitiveTopology};
use bevy::pbr::{MaterialPipeline, MaterialPipelineKey};
use bevy::prelude::*;
use bevy::render::gpu_readback::{Readback, ReadbackComplete};
use bevy::render::render_resource::{
    AsBindGroup, PollType, RenderPipelineDescriptor, SpecializedMeshPipelineError, TextureFormat, TextureUsages,
};
use bevy::render::renderer::{RenderAdapterInfo, RenderDevice};
use bevy::render::{Render, RenderApp, RenderSystems};
use bevy::shader::ShaderRef;

/// Frames until pictures come back, shaders compiled in the background and all.
const MOST_FRAMES_OF_START: usize = 500;

/// A material that does nothing but its colour.
#[derive(Asset, TypePath, AsBindGroup, Clone)]
struct Bare {
    #[uniform(0)]
    color: LinearRgba,
}

impl Material for Bare {
    fn fragment_shader() -> ShaderRef {
        "embedded://pellucid_peer_bevy/bare.wgsl".into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        AlphaMode::Blend
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        _: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        descriptor.primitive.cull_mode = None;
        Ok(())
    }
}

/// An app that draws one scene.
pub(crate) struct Engine {
    app: App,
    target: Handle<Image>,
}

impl Engine {
    /// Of the first mesh of a scene, where it is, in the colour of the first material. `lists`: how many fragments of a pixel are sorted, and how many a pixel has on average;
    /// without, they are blended as they come.
    pub(crate) fn new(scene: &pellucid::Scene, view: &pellucid::View, lists: Option<(u32, f32)>) -> Self {
        let mut app = App::new();
        app.insert_resource(ClearColor(Color::WHITE))
            .add_plugins(DefaultPlugins.build().disable::<TerminalCtrlCHandlerPlugin>())
            .add_plugins(MaterialPlugin::<Bare>::default());
        embedded_asset!(app, "bare.wgsl");
        app.sub_app_mut(RenderApp).add_systems(Render, wait.in_set(RenderSystems::Cleanup));
        while app.plugins_state() == PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();

        let world = app.world_mut();
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh(&scene.meshes()[0]));
        let [r, g, b, alpha] = scene.materials()[0].base_color.to_array();
        let color = LinearRgba::new(r, g, b, alpha * view.opacity);
        let material = world.resource_mut::<Assets<Bare>>().add(Bare { color });
        world.spawn((Mesh3d(mesh), MeshMaterial3d(material), NoFrustumCulling));
        let mut image = Image::new_target_texture(view.width, view.height, TextureFormat::Rgba8UnormSrgb, None);
        image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        let target = world.resource_mut::<Assets<Image>>().add(image);
        let vector = |v: glam::Vec3| Vec3::from_array(v.to_array());
        let [eye, at, up] = [view.camera.eye, view.camera.target, view.camera.up].map(vector);
        let (fov, near) = crate::perspective(view);
        let mut camera = world.spawn((
            Camera3d::default(),
            RenderTarget::Image(target.clone().into()),
            Msaa::Off,
            Tonemapping::None,
            Projection::Perspective(PerspectiveProjection { fov, near, far: near * 1e6, ..Default::default() }),
            Transform::from_translation(eye).looking_at(at, up),
        ));
        if let Some((sorted, average)) = lists {
            camera.insert(OrderIndependentTransparencySettings {
                sorted_fragment_max_count: sorted,
                fragments_per_pixel_average: average,
                alpha_threshold: 0.0,
            });
        }
        Self { app, target }
    }

    /// Renders a frame, waits for it, and tells the milliseconds that took.
    pub(crate) fn frame_ms(&mut self) -> f64 {
        let start = Instant::now();
        self.app.update();
        start.elapsed().as_secs_f64() * 1e3
    }

    /// The name of the device it draws on.
    pub(crate) fn adapter(&self) -> &str {
        &self.app.world().resource::<RenderAdapterInfo>().name
    }

    /// How many pixels are not background, as soon as any are.
    pub(crate) fn covered_pixels(&mut self) -> usize {
        let covered = Arc::new(Mutex::new(0));
        let of_last = covered.clone();
        let readback = self.app.world_mut().spawn(Readback::texture(self.target.clone()));
        let readback = readback.id();
        self.app.world_mut().entity_mut(readback).observe(move |picture: On<ReadbackComplete>| {
            // Before the first frame has been drawn all are 0.
            let count = picture.data.chunks_exact(4).filter(|pixel| pixel[3] > 0 && pixel[..3] != [255; 3]).count();
            *of_last.lock().expect("no panic holds it") = count;
        });
        let mut count = 0;
        for _ in 0..MOST_FRAMES_OF_START {
            self.app.update();
            count = *covered.lock().expect("no panic holds it");
            if count > 0 {
                break;
            }
        }
        self.app.world_mut().despawn(readback);
        count
    }
}

fn wait(device: Res<RenderDevice>) {
    device.poll(PollType::wait_indefinitely()).expect("the device is there");
}

fn mesh(mesh: &pellucid::Mesh) -> Mesh {
    let positions: Vec<[f32; 3]> = mesh.positions().iter().map(|point| point.to_array()).collect();
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_indices(Indices::U32(mesh.triangles().as_flattened().to_vec()))
}
