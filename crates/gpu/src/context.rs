//! The device: which adapter, with which features, and how its errors become ours.

use std::sync::{Arc, Mutex, PoisonError};

use wgpu::{Backends, DeviceType, Features, InstanceDescriptor, Limits};

use crate::GpuError;

/// Which device is opened.
#[derive(Debug, Clone, Default)]
pub struct ContextOptions {
    /// The portability floor: WebGPU's default limits and no features, whatever the device has.
    pub floor: bool,
    /// Whether an adapter that runs on the CPU will do if there is no other.
    pub allow_software: bool,
}

/// An adapter of this machine.
#[derive(Debug, Clone, PartialEq)]
pub struct AdapterSummary {
    /// Its name.
    pub name: String,
    /// Vulkan, Metal or DirectX 12.
    pub backend: String,
    /// Its driver's name and version.
    pub driver: String,
    /// Whether it runs on the CPU.
    pub is_software: bool,
    /// Features that make techniques faster, by WebGPU's name.
    pub features: Vec<&'static str>,
    /// Most bytes of one storage binding.
    pub max_binding_bytes: u64,
}

/// Features that are used where they are there, with their names.
const USEFUL: [(Features, &str); 3] = [
    (Features::TIMESTAMP_QUERY, "timestamp-query"),
    (Features::PRIMITIVE_INDEX, "primitive-index"),
    (Features::SUBGROUP, "subgroups"),
];

/// An open device.
#[derive(Debug)]
pub struct Context {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) limits: Limits,
    pub(crate) features: Features,
    name: String,
    is_software: bool,
    faults: Arc<Mutex<Vec<GpuError>>>,
}

impl Context {
    /// Opens the best adapter: a discrete GPU before an integrated one, before any other.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`], [`GpuError::OnlySoftware`] or [`GpuError::Refused`].
    pub fn new(options: &ContextOptions) -> Result<Self, GpuError> {
        let adapter = adapters()
            .into_iter()
            .min_by_key(|adapter| rank(adapter.get_info().device_type))
            .ok_or(GpuError::NoAdapter)?;
        let info = adapter.get_info();
        let is_software = info.device_type == DeviceType::Cpu;
        if is_software && !options.allow_software {
            return Err(GpuError::OnlySoftware { name: info.name });
        }
        let (features, limits) = if options.floor {
            (Features::empty(), Limits::defaults())
        } else {
            let useful = USEFUL.iter().fold(Features::empty(), |all, &(feature, _)| all | feature);
            (adapter.features() & useful, adapter.limits())
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("pellucid"),
            required_features: features,
            required_limits: limits.clone(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| GpuError::Refused { name: info.name.clone(), detail: error.to_string() })?;
        let faults = Arc::new(Mutex::new(Vec::new()));
        let (uncaptured, lost) = (Arc::clone(&faults), Arc::clone(&faults));
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| push(&uncaptured, fault(&error))));
        device.set_device_lost_callback(move |reason, detail| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                push(&lost, GpuError::Lost(detail));
            }
        });
        let name =
            if info.driver_info.is_empty() { info.name } else { format!("{} ({})", info.name, info.driver_info) };
        Ok(Self { device, queue, limits, features, name, is_software, faults })
    }

    /// A device that somebody else opened, and whose errors stay theirs.
    pub(crate) fn adopt(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let (limits, features) = (device.limits(), device.features());
        let faults = Arc::default();
        Self { device, queue, limits, features, name: "your device".to_owned(), is_software: false, faults }
    }

    /// The device itself.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Where its work is submitted.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// The device, in words.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether it runs on the CPU.
    pub fn is_software(&self) -> bool {
        self.is_software
    }

    pub(crate) fn has(&self, feature: Features) -> bool {
        self.features.contains(feature)
    }

    /// Reports the first error since the last call: a lost device before any other, as others follow from it.
    pub(crate) fn check(&self) -> Result<(), GpuError> {
        let mut faults = self.faults.lock().unwrap_or_else(PoisonError::into_inner);
        let lost = faults.iter().position(|fault| matches!(fault, GpuError::Lost(_)));
        let first = faults.drain(..).nth(lost.unwrap_or(0));
        first.map_or(Ok(()), Err)
    }

    /// Waits until everything submitted is done.
    ///
    /// # Errors
    /// The first error since the last call.
    pub fn wait(&self) -> Result<(), GpuError> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        polled.map(drop).map_err(|error| GpuError::Lost(error.to_string()))
    }

    /// A buffer; a storage buffer must fit one binding.
    pub(crate) fn buffer(&self, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer, GpuError> {
        let is_binding = usage.contains(wgpu::BufferUsages::STORAGE);
        let (limit, limit_name) = if is_binding && self.max_binding_bytes() < self.limits.max_buffer_size {
            (self.max_binding_bytes(), "maxStorageBufferBindingSize")
        } else {
            (self.limits.max_buffer_size, "maxBufferSize")
        };
        if bytes > limit {
            return Err(GpuError::Limit { what: label.into(), size: bytes, limit, limit_name });
        }
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let descriptor = wgpu::BufferDescriptor { label: Some(label), size: bytes, usage, mapped_at_creation: false };
        let buffer = self.device.create_buffer(&descriptor);
        match pollster::block_on(scope.pop()) {
            None => Ok(buffer),
            Some(_) => Err(GpuError::OutOfMemory { what: label.into(), bytes }),
        }
    }

    /// A texture.
    pub(crate) fn texture(&self, descriptor: &wgpu::TextureDescriptor<'_>) -> Result<wgpu::Texture, GpuError> {
        let (label, size) = (descriptor.label.unwrap_or("a texture"), descriptor.size);
        let (side, layers, limits) = (size.width.max(size.height), size.depth_or_array_layers, &self.limits);
        for (part, size, limit, limit_name) in [
            ("a side", side, limits.max_texture_dimension_2d, "maxTextureDimension2D"),
            ("the layers", layers, limits.max_texture_array_layers, "maxTextureArrayLayers"),
        ] {
            if size > limit {
                let what = format!("{part} of {label}");
                return Err(GpuError::Limit { what, size: size.into(), limit: limit.into(), limit_name });
            }
        }
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let texture = self.device.create_texture(descriptor);
        match pollster::block_on(scope.pop()) {
            None => Ok(texture),
            Some(_) => {
                let texel_bytes = descriptor.format.block_copy_size(None).unwrap_or(4);
                let texels = u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers);
                let bytes = texels * u64::from(texel_bytes);
                Err(GpuError::OutOfMemory { what: label.into(), bytes })
            }
        }
    }

    /// Most bytes of one storage binding.
    pub(crate) fn max_binding_bytes(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size
    }
}

/// The adapters of this machine, the best first.
pub fn adapter_summaries() -> Vec<AdapterSummary> {
    let mut adapters = adapters();
    adapters.sort_by_key(|adapter| rank(adapter.get_info().device_type));
    adapters
        .iter()
        .map(|adapter| {
            let info = adapter.get_info();
            AdapterSummary {
                name: info.name,
                backend: info.backend.to_string(),
                driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
                is_software: info.device_type == DeviceType::Cpu,
                features: USEFUL
                    .iter()
                    .filter(|(feature, _)| adapter.features().contains(*feature))
                    .map(|&(_, name)| name)
                    .collect(),
                max_binding_bytes: adapter.limits().max_storage_buffer_binding_size,
            }
        })
        .collect()
}

fn adapters() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(InstanceDescriptor::new_without_display_handle());
    pollster::block_on(instance.enumerate_adapters(Backends::PRIMARY))
}

fn rank(device_type: DeviceType) -> u8 {
    match device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}

fn fault(error: &wgpu::Error) -> GpuError {
    match error {
        wgpu::Error::OutOfMemory { .. } => GpuError::OutOfMemory { what: "a buffer or texture".into(), bytes: 0 },
        wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
            GpuError::Validation(description.clone())
        }
    }
}

fn push(faults: &Mutex<Vec<GpuError>>, fault: GpuError) {
    faults.lock().unwrap_or_else(PoisonError::into_inner).push(fault);
}
