//! Which renderer draws: `--backend` of the programs.

use std::fmt;

use strandlight_render::gpu::Context;

/// What was asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BackendChoice {
    /// The GPU if there is one, else the CPU; a software driver is none, but in pages.
    #[default]
    Auto,
    /// The GPU, or a software driver.
    Gpu,
    /// The CPU.
    Cpu,
}

impl BackendChoice {
    /// All of them.
    pub const ALL: [BackendChoice; 3] =
        [BackendChoice::Auto, BackendChoice::Gpu, BackendChoice::Cpu];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            BackendChoice::Auto => "auto",
            BackendChoice::Gpu => "gpu",
            BackendChoice::Cpu => "cpu",
        }
    }

    /// Decides; `open` opens the GPU's device and is called only if one may be used.
    ///
    /// # Errors
    /// No device where it was asked for.
    pub fn decide<E: fmt::Display>(
        self,
        open: impl FnOnce() -> Result<Context, E>,
    ) -> Result<Chosen, E> {
        match self {
            BackendChoice::Cpu => Ok(Chosen::Cpu(CpuReason::Asked)),
            BackendChoice::Gpu => open().map(Chosen::Gpu),
            BackendChoice::Auto => Ok(match open() {
                // A page has one thread, a browser's software driver has all.
                Ok(context) if context.is_software() && !cfg!(target_arch = "wasm32") => {
                    Chosen::Cpu(CpuReason::Software(context.adapter_name))
                }
                Ok(context) => Chosen::Gpu(context),
                Err(error) => Chosen::Cpu(CpuReason::Failed(error.to_string())),
            }),
        }
    }
}

/// What draws.
#[derive(Debug)]
pub enum Chosen {
    /// A device.
    Gpu(Context),
    /// No device, and why.
    Cpu(CpuReason),
}

/// Why the CPU draws.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CpuReason {
    /// It was asked for.
    Asked,
    /// The only adapter, of this name, is a program that draws on the CPU as well, more slowly.
    Software(String),
    /// There is no GPU, or it cannot draw the scene: in words.
    Failed(String),
}

impl CpuReason {
    /// In two or three words.
    pub fn short(&self) -> &'static str {
        match self {
            CpuReason::Asked => "as chosen",
            CpuReason::Software(_) => "no hardware GPU",
            CpuReason::Failed(_) => "no usable GPU",
        }
    }
}

impl fmt::Display for CpuReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CpuReason::Asked => f.write_str("as chosen by --backend cpu"),
            CpuReason::Software(adapter) => {
                write!(f, "the only adapter, {adapter}, is a software driver")
            }
            CpuReason::Failed(error) => f.write_str(error),
        }
    }
}
