//! The LFB in a renderer of one's own: known answers, every payload, two at once, and every way it can be misused.

mod common;

use pellucid_gpu::lfb::{Access, Lfb, LfbData, LfbError, LfbModule, LfbOptions, Nearest};
use pellucid_gpu::wgpu;

#[path = "../examples/two_views/render.rs"]
mod two_views;

/// Devices of somebody else: on WebGPU's default limits, and on all the adapter has. Their errors panic.
fn devices() -> Vec<(wgpu::Device, wgpu::Queue)> {
    if common::renderer(true).is_none() {
        return Vec::new();
    }
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).expect("there was one just now");
    [
        (wgpu::Limits::defaults(), wgpu::Features::empty()),
        (adapter.limits(), adapter.features() & wgpu::Features::all_webgpu_mask()),
    ]
    .map(|(required_limits, required_features)| {
        let descriptor = wgpu::DeviceDescriptor { required_limits, required_features, ..Default::default() };
        pollster::block_on(adapter.request_device(&descriptor)).unwrap()
    })
    .into()
}

/// A triangle over everything for each instance.
const VERTEX: &str = "
    struct Drawn { @builtin(position) at: vec4<f32>, @location(0) @interpolate(flat) i: u32 }
    @vertex fn vertex(@builtin(vertex_index) v: u32, @builtin(instance_index) i: u32) -> Drawn {
        return Drawn(vec4(f32(v & 1u) * 4.0 - 1.0, f32(v & 2u) * 2.0 - 1.0, 0.5, 1.0), i);
    }";

/// A renderer of somebody else.
struct Drawing {
    pipeline: wgpu::RenderPipeline,
    target: wgpu::TextureView,
}

impl Drawing {
    /// `fragment` begins with the modules, and is called `fragment`.
    fn new(device: &wgpu::Device, fragment: String, groups: &[&Lfb], width: u32, height: u32) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl((fragment + VERTEX).into()),
        });
        let layouts: Vec<_> = groups.iter().map(|lfb| Some(lfb.layout(Access::Capture))).collect();
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let format = wgpu::TextureFormat::R8Unorm;
        let target = wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::empty() };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &[Some(target)],
            }),
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            multiview_mask: None,
            cache: None,
        });
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        Self { pipeline, target: texture.create_view(&Default::default()) }
    }

    fn draw(&self, encoder: &mut wgpu::CommandEncoder, groups: &[&wgpu::BindGroup], instances: u32) {
        let attachment = wgpu::RenderPassColorAttachment {
            view: &self.target,
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        for (group, number) in groups.iter().zip(0..) {
            pass.set_bind_group(number, *group, &[]);
        }
        pass.draw(0..3, 0..instances);
    }
}

fn fragment(body: &str) -> String {
    format!(
        "@fragment fn fragment(in: Drawn) -> @location(0) vec4<f32> {{
        let pixel = vec2<u32>(in.at.xy); let i = in.i; {body} return vec4(0.0); }}"
    )
}

/// One LFB, and a drawing that adds to it under the name `lfb`.
fn set_up(gpu: &(wgpu::Device, wgpu::Queue), options: &LfbOptions, body: &str) -> (Lfb, Drawing) {
    let lfb = Lfb::new(&gpu.0, &gpu.1, options).unwrap();
    let text = lfb.module("lfb", 0, Access::Capture).wgsl().unwrap() + &fragment(body);
    let drawing = Drawing::new(&gpu.0, text, &[&lfb], options.width, options.height);
    (lfb, drawing)
}

const QUADS: &str = "lfb_add_color(pixel, vec4(0.25, 0.0, 0.0, 0.25), f32(i), i);";

#[test]
fn quads_leave_what_they_let_through() {
    for gpu in devices() {
        for n in [0, 1, 7, 33, 500] {
            let (mut lfb, drawing) = set_up(&gpu, &LfbOptions::new(13, 9), QUADS);
            lfb.capture(|encoder, group| drawing.draw(encoder, &[group], n)).unwrap();
            assert_eq!(lfb.fragments(), n * 13 * 9);
            // A shader that reads all it can read: what gets through, and the number of fragments.
            let text = lfb.module("glass", 0, Access::Read).wgsl().unwrap()
                + "@group(1) @binding(0) var<storage, read_write> out: array<vec2<f32>>;
                @compute @workgroup_size(1) fn main(@builtin(workgroup_id) at: vec3<u32>) {
                    let range = glass_range(at.xy);
                    var through = 1.0;
                    for (var i = range.first; i < range.end; i++) { through *= 1.0 - glass_color(glass_at(i)).w; }
                    for (var i = 0u; i < glass_fragment_count(at.xy); i++) {
                        if glass_load(at.xy, i).order != i { through = -1.0; }
                    }
                    if glass_fragment_count(glass_size()) != 0u { through = -2.0; }
                    out[at.y * glass_size().x + at.x] = vec2(through, f32(range.end - range.first));
                }";
            let through: Vec<[f32; 2]> = compute(&gpu, &text, &[&lfb], [13, 9]);
            for [through, count] in through {
                assert_eq!(count, n as f32);
                assert!((through - 0.75f32.powi(n as i32)).abs() < 1e-6, "{through} after {n}");
            }
        }
    }
}

/// Runs `main` once for each pixel with what it writes in the group after the LFBs.
fn compute<T: bytemuck::Pod>(gpu: &(wgpu::Device, wgpu::Queue), text: &str, lfbs: &[&Lfb], size: [u32; 2]) -> Vec<T> {
    let (device, queue) = gpu;
    let source = wgpu::ShaderSource::Wgsl(text.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let bytes = u64::from(size[0] * size[1]) * size_of::<T>() as u64;
    let buffer = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor { label: None, size: bytes, usage, mapped_at_creation: false })
    };
    let out = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let staging = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let out_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &Lfb::layout_entries(Access::Capture, 5, wgpu::ShaderStages::COMPUTE)[1..2]
            .iter()
            .map(|entry| wgpu::BindGroupLayoutEntry { binding: 0, ..*entry })
            .collect::<Vec<_>>(),
    });
    let mut layouts: Vec<_> = lfbs.iter().map(|lfb| Some(lfb.layout(Access::Read))).collect();
    layouts.push(Some(&out_layout));
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: Some(&layout),
        module: &module,
        entry_point: None,
        compilation_options: Default::default(),
        cache: None,
    });
    let entries = [wgpu::BindGroupEntry { binding: 0, resource: out.as_entire_binding() }];
    let group =
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &out_layout, entries: &entries });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    for (lfb, number) in lfbs.iter().zip(0..) {
        pass.set_bind_group(number, lfb.read_group().unwrap(), &[]);
    }
    pass.set_bind_group(lfbs.len() as u32, &group, &[]);
    pass.dispatch_workgroups(size[0], size[1], 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&out, 0, &staging, 0, bytes);
    queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    bytemuck::pod_collect_to_vec(&staging.get_mapped_range(..).unwrap())
}

/// The order that `(i * 7) % 5 - 2` as depth, negative ones too, and `i / 3` as order must come in.
const TIES: &str = "f32((i * 7u) % 5u) - 2.0, i / 3u);";

#[test]
fn payloads_of_every_length_come_back_in_order() {
    let payloads = ["i * 3u", "vec2(i, ~i)", "vec3(i, ~i, pixel.x)", "vec4(i, ~i, pixel.x, pixel.y)"];
    for gpu in devices() {
        for (payload, payload_words) in payloads.into_iter().zip(1..) {
            for (n, nearest) in
                [(20, Nearest::Smallest), (20, Nearest::Greatest), (77, Nearest::Smallest), (77, Nearest::Greatest)]
            {
                let options = LfbOptions { payload_words, nearest, ..LfbOptions::new(11, 3) };
                let (mut lfb, drawing) = set_up(&gpu, &options, &format!("lfb_add(pixel, {payload}, {TIES}"));
                lfb.capture(|encoder, group| drawing.draw(encoder, &[group], n)).unwrap();
                let content = lfb.read().unwrap();
                for (x, y) in [(0, 0), (10, 0), (5, 1), (10, 2)] {
                    let mut expected: Vec<(f32, u32, Vec<u32>)> = (0..n)
                        .map(|i| {
                            let words = [if payload_words == 1 { i * 3 } else { i }, !i, x, y];
                            ((i * 7 % 5) as f32 - 2.0, i / 3, words[..payload_words as usize].to_vec())
                        })
                        .collect();
                    // Nearest first; level ones by greatest order, then greatest payload.
                    expected.sort_by(|a, b| {
                        let by_depth =
                            if nearest == Nearest::Smallest { a.0.total_cmp(&b.0) } else { b.0.total_cmp(&a.0) };
                        by_depth.then(b.1.cmp(&a.1)).then(b.2.cmp(&a.2))
                    });
                    let have: Vec<_> = content.pixel(x, y).map(|f| (f.depth, f.order, f.payload.to_vec())).collect();
                    assert_eq!(have, expected, "{payload_words} words, {nearest:?}");
                }
                assert_eq!(content.pixel(11, 0).len() + content.pixel(0, 3).len(), 0);
                assert_eq!(content.total(), n * 33);
            }
        }
    }
}

#[test]
fn two_are_bound_at_once() {
    for gpu in devices() {
        let mut near = Lfb::new(&gpu.0, &gpu.1, &LfbOptions::new(16, 8)).unwrap();
        let options = LfbOptions { payload_words: 3, nearest: Nearest::Greatest, ..LfbOptions::new(5, 4) };
        let mut odd = Lfb::new(&gpu.0, &gpu.1, &options).unwrap();
        let text = near.module("near", 0, Access::Capture).wgsl().unwrap()
            + &odd.module("odd_ones", 1, Access::Capture).wgsl().unwrap()
            + &fragment(
                "near_add(pixel, vec2(i), f32(i), i);
                if (i & 1u) == 1u && all(pixel < odd_ones_size()) { odd_ones_add(pixel, vec3(i), f32(i), i); }",
            );
        let drawing = Drawing::new(&gpu.0, text, &[&near, &odd], 16, 8);
        let encoder = || gpu.0.create_command_encoder(&Default::default());
        let mut counting = encoder();
        near.begin(&mut counting).unwrap();
        odd.begin(&mut counting).unwrap();
        drawing.draw(&mut counting, &[near.bind_group().unwrap(), odd.bind_group().unwrap()], 10);
        near.sum(&mut counting).unwrap();
        odd.sum(&mut counting).unwrap();
        gpu.1.submit([counting.finish()]);
        near.allocate().unwrap();
        odd.allocate().unwrap();
        let mut capturing = encoder();
        drawing.draw(&mut capturing, &[near.bind_group().unwrap(), odd.bind_group().unwrap()], 10);
        near.end(&mut capturing).unwrap();
        odd.end(&mut capturing).unwrap();
        gpu.1.submit([capturing.finish()]);
        let read = near.module("near", 0, Access::Read).wgsl().unwrap()
            + &odd.module("odd_ones", 1, Access::Read).wgsl().unwrap()
            + "@group(2) @binding(0) var<storage, read_write> out: array<vec4<u32>>;
            @compute @workgroup_size(1) fn main(@builtin(workgroup_id) at: vec3<u32>) {
                var first = vec2(99u);
                if odd_ones_fragment_count(at.xy) > 0u { first.y = odd_ones_load(at.xy, 0u).payload.z; }
                first.x = near_load(at.xy, 0u).payload.y;
                out[at.y * 16u + at.x] = vec4(near_fragment_count(at.xy), odd_ones_fragment_count(at.xy), first);
            }";
        let seen: Vec<[u32; 4]> = compute(&gpu, &read, &[&near, &odd], [16, 8]);
        for (i, seen) in seen.into_iter().enumerate() {
            let is_in_both = i % 16 < 5 && i / 16 < 4;
            assert_eq!(seen, if is_in_both { [10, 5, 0, 9] } else { [10, 0, 0, 99] });
        }
        near.check().unwrap();
        odd.check().unwrap();
    }
}

#[test]
fn passes_that_disagree_are_found_out() {
    for gpu in devices() {
        let (mut lfb, drawing) = set_up(&gpu, &LfbOptions::new(8, 8), QUADS);
        let capture = |lfb: &mut Lfb, first, second| {
            let mut counts = [first, second].into_iter();
            lfb.capture(|encoder, group| drawing.draw(encoder, &[group], counts.next().unwrap()))
        };
        assert_eq!(capture(&mut lfb, 3, 5), Err(LfbError::Disagree { pixels: 64, beyond: 128 }));
        assert!(lfb.read_group().is_err());
        assert_eq!(capture(&mut lfb, 5, 3), Err(LfbError::Disagree { pixels: 64, beyond: 0 }));
        assert_eq!(capture(&mut lfb, 4, 4), Ok(()));
        assert_eq!(lfb.read().unwrap().pixel(7, 7).len(), 4);

        let shifted = "lfb_add_color(pixel + vec2(6u, 0u), vec4(0.5), 0.5, i);";
        let (mut lfb, drawing) = set_up(&gpu, &LfbOptions::new(8, 8), shifted);
        let outside = LfbError::Outside { fragments: 6 * 8, width: 8, height: 8 };
        assert_eq!(lfb.capture(|encoder, group| drawing.draw(encoder, &[group], 1)), Err(outside));
    }
}

#[test]
fn sizes_and_limits_are_errors() {
    for gpu in devices() {
        let new = |options: LfbOptions| Lfb::new(&gpu.0, &gpu.1, &options).map(drop);
        assert_eq!(new(LfbOptions::new(0, 5)), Err(LfbError::ZeroSize { width: 0, height: 5 }));
        assert!(matches!(new(LfbOptions::new(1 << 20, 1)), Err(LfbError::Limit { .. })));
        assert_eq!(new(LfbOptions { payload_words: 5, ..LfbOptions::new(1, 1) }), Err(LfbError::Payload(5)));

        let options = LfbOptions { max_bytes: 16 * 64 * 4, ..LfbOptions::new(8, 8) };
        let (mut lfb, drawing) = set_up(&gpu, &options, QUADS);
        let capture = |lfb: &mut Lfb, n| lfb.capture(|encoder, group| drawing.draw(encoder, &[group], n));
        assert_eq!(capture(&mut lfb, 4), Ok(()));
        let overflow = LfbError::Overflow { fragments: 320, bytes: 5120, limit: 4096, limit_name: "max_bytes" };
        assert_eq!(capture(&mut lfb, 5), Err(overflow));
        assert_eq!(capture(&mut lfb, 1), Ok(()));

        assert!(lfb.resize(0, 0).is_err());
        assert!(lfb.resize(5, 3).is_ok() && lfb.read_group().is_err());
        let text = lfb.module("lfb", 0, Access::Capture).wgsl().unwrap() + &fragment(QUADS);
        let smaller = Drawing::new(&gpu.0, text, &[&lfb], 5, 3);
        lfb.capture(|encoder, group| smaller.draw(encoder, &[group], 6)).unwrap();
        let content = lfb.read().unwrap();
        assert_eq!((content.total(), content.pixel(4, 2).len(), content.pixel(5, 2).len()), (90, 6, 0));
    }
}

#[test]
fn more_than_a_binding_takes_is_an_error() {
    // On default limits: 128 MiB are 8 Mi fragments.
    let Some(gpu) = devices().into_iter().next() else { return };
    let (mut lfb, drawing) = set_up(&gpu, &LfbOptions::new(1024, 1024), QUADS);
    let outcome = lfb.capture(|encoder, group| drawing.draw(encoder, &[group], 9));
    let limit_name = "maxStorageBufferBindingSize";
    let (fragments, limit) = (9 << 20, 128 << 20);
    assert_eq!(outcome, Err(LfbError::Overflow { fragments, bytes: 9 << 24, limit, limit_name }));
}

#[test]
fn steps_out_of_turn_are_errors() {
    for gpu in devices() {
        let (mut lfb, drawing) = set_up(&gpu, &LfbOptions::new(4, 4), QUADS);
        let mut encoder = gpu.0.create_command_encoder(&Default::default());
        let out_of_turn = |result: Result<(), LfbError>| assert!(matches!(result, Err(LfbError::OutOfTurn { .. })));
        out_of_turn(lfb.bind_group().map(drop));
        out_of_turn(lfb.sum(&mut encoder));
        out_of_turn(lfb.end(&mut encoder));
        out_of_turn(lfb.check());
        out_of_turn(lfb.read_group().map(drop));
        lfb.begin(&mut encoder).unwrap();
        out_of_turn(lfb.allocate());
        lfb.begin(&mut encoder).unwrap();
        drawing.draw(&mut encoder, &[lfb.bind_group().unwrap()], 2);
        lfb.sum(&mut encoder).unwrap();
        assert_eq!(lfb.allocate(), Err(LfbError::NotSubmitted("sum")));
    }
}

#[test]
fn modules_are_valid_under_any_name() {
    for access in [Access::Capture, Access::Read] {
        for (name, payload_words) in [("lfb", 1), ("", 2), ("a_Lfb_lfb_2", 3), ("Lfb", 4)] {
            let module = LfbModule { name, group: 2, first_binding: 3, payload_words, access };
            let text = module.wgsl().unwrap();
            let parsed = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
            let bindings: Vec<_> =
                parsed.global_variables.iter().filter_map(|(_, v)| v.binding.map(|b| (b.group, b.binding))).collect();
            let expected: Vec<_> =
                (3..if access == Access::Read { 6 } else { 7 }).map(|binding| (2, binding)).collect();
            assert_eq!(bindings, expected);
            let data = parsed.types.iter().find_map(|(_, ty)| match &ty.inner {
                naga::TypeInner::Struct { members, span } if ty.name.as_ref()?.ends_with("Data") => {
                    Some((members.iter().map(|m| m.offset as usize).collect::<Vec<_>>(), *span as usize))
                }
                _ => None,
            });
            use std::mem::offset_of;
            let offsets =
                vec![offset_of!(LfbData, size), offset_of!(LfbData, is_counting), offset_of!(LfbData, depth_flip)];
            assert_eq!(data, Some((offsets, size_of::<LfbData>())));
        }
    }
    for name in ["1", "_a", "a-b", "é"] {
        let module = LfbModule { name, group: 0, first_binding: 0, payload_words: 2, access: Access::Read };
        assert_eq!(module.wgsl(), Err(LfbError::Name(name.into())));
    }
}

#[test]
fn the_example_casts_coloured_shadows() {
    for gpu in devices() {
        let picture = two_views::render(&gpu.0, &gpu.1, 96, 54).unwrap();
        assert_eq!(picture, two_views::render(&gpu.0, &gpu.1, 96, 54).unwrap());
        assert_eq!(picture.len(), 96 * 54 * 4);
        assert!(picture.chunks_exact(4).all(|pixel| pixel[3] == 255));
        // Light through glass: somewhere on the floor, which is grey, there is red, and somewhere blue.
        let floor = || picture.chunks_exact(4).skip(96 * 40).map(|pixel| i32::from(pixel[0]) - i32::from(pixel[2]));
        assert!(floor().max() > Some(30) && floor().min() < Some(-30), "{:?} {:?}", floor().max(), floor().min());
    }
}
