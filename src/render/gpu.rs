//! A headless graphics device and the few things every pass needs of it.

use super::shaders::Shader;
use crate::{Error, Result};
use std::sync::{Arc, Mutex, PoisonError};

/// A device without a window. Errors that wgpu finds later are kept and reported by
/// [`Gpu::check`], so that nothing panics inside the driver's callbacks.
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    name: String,
    fault: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Takes the fastest Vulkan adapter there is, a software one included.
    pub fn new() -> Result<Gpu> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options))
            .map_err(|e| Error::Gpu(format!("no graphics adapter: {e}")))?;
        let info = adapter.get_info();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("dapple"),
            // All the adapter can do: scenes and tracks are as large as they are.
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| Error::Gpu(format!("{}: cannot open the device: {e}", info.name)))?;
        let fault = Arc::new(Mutex::new(None));
        let keep = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            let mut fault = keep.lock().unwrap_or_else(PoisonError::into_inner);
            fault.get_or_insert_with(|| e.to_string());
        }));
        let software = info.device_type == wgpu::DeviceType::Cpu;
        let kind = if software { " software driver" } else { "" };
        let name = format!("{}, {:?}{kind}", info.name, info.backend);
        Ok(Gpu {
            device,
            queue,
            name,
            fault,
        })
    }

    /// The compiled module of a pass.
    pub fn module(&self, shader: &Shader) -> wgpu::ShaderModule {
        self.device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(shader.name),
                source: wgpu::ShaderSource::Wgsl(shader.source.into()),
            })
    }

    /// The adapter and its interface, and whether it is software.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The first error since the last call, as one sentence.
    pub fn check(&self) -> Result<()> {
        let mut fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner);
        match fault.take() {
            Some(text) => {
                let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
                Err(Error::Gpu(format!("{}: {text}", self.name)))
            }
            None => Ok(()),
        }
    }

    /// A storage buffer of `bytes`, at least 16 bytes long, for bindings may not be empty.
    pub fn storage(&self, label: &str, bytes: &[u8]) -> Result<wgpu::Buffer> {
        let buffer = self.empty_storage(label, bytes.len() as u64)?;
        self.queue.write_buffer(&buffer, 0, bytes);
        Ok(buffer)
    }

    /// A storage buffer of `size` bytes, rounded up to 16.
    pub fn empty_storage(&self, label: &str, size: u64) -> Result<wgpu::Buffer> {
        let limits = self.device.limits();
        let most = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size);
        if size > most {
            return Err(Error::Gpu(format!(
                "{}: {label} needs {size} bytes in one buffer and the device allows {most}",
                self.name
            )));
        }
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: size.max(16).next_multiple_of(16),
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_DST
                | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        }))
    }

    pub fn uniform(&self, label: &str, bytes: &[u8]) -> wgpu::Buffer {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: (bytes.len() as u64).next_multiple_of(16),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }

    /// Bindings 0, 1, ... of whole buffers.
    pub fn bind(
        &self,
        layout: &wgpu::BindGroupLayout,
        buffers: &[&wgpu::Buffer],
    ) -> wgpu::BindGroup {
        let numbered: Vec<_> = (0..).zip(buffers.iter().copied()).collect();
        self.bind_numbered(layout, &numbered)
    }

    /// A bind group of buffers, each with its binding number.
    pub fn bind_numbered(
        &self,
        layout: &wgpu::BindGroupLayout,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> wgpu::BindGroup {
        let mut entries = Vec::with_capacity(buffers.len());
        for &(binding, buffer) in buffers {
            let resource = buffer.as_entire_binding();
            entries.push(wgpu::BindGroupEntry { binding, resource });
        }
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        })
    }

    /// A buffer that results are copied into to be read with [`Gpu::read`].
    pub fn staging(&self, size: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("staging"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// Submits the commands, waits for them and hands the staging buffer's bytes to `use_bytes`.
    pub fn read<T>(
        &self,
        commands: wgpu::CommandEncoder,
        staging: &wgpu::Buffer,
        use_bytes: impl FnOnce(&[u8]) -> T,
    ) -> Result<T> {
        self.queue.submit([commands.finish()]);
        let slice = staging.slice(..);
        slice.map_async(wgpu::MapMode::Read, |_| {});
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        waited.map_err(|e| Error::Gpu(format!("{}: {e}", self.name)))?;
        let view = slice
            .get_mapped_range()
            .map_err(|e| Error::Gpu(format!("{}: cannot read back: {e}", self.name)))?;
        let out = use_bytes(&view);
        drop(view);
        staging.unmap();
        Ok(out)
    }
}

/// The adapter for a test. Without one, a test run in CI fails and any other skips with a word.
#[cfg(test)]
pub(crate) fn for_test() -> Option<Gpu> {
    match Gpu::new() {
        Ok(gpu) => Some(gpu),
        Err(e) if std::env::var_os("CI").is_some() => panic!("CI needs an adapter: {e}"),
        Err(e) => {
            eprintln!("skipped: {e}");
            None
        }
    }
}
