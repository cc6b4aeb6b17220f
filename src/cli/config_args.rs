//! Arguments shared by several verbs.

use super::ui::Ui;
use crate::Split;
use orator_base::stage::progress::Progress as _;
use orator_base::types::device::DeviceChoice;
use orator_nn::device::{self, Device};
use std::path::PathBuf;

/// Configuration file and overrides of its keys.
#[derive(clap::Args, Clone, Debug)]
pub struct ConfigArgs {
    /// Configuration file.
    #[arg(short, long, default_value = "pipeline.toml", value_name = "FILE")]
    pub config: PathBuf,
    /// Override one configuration key, such as `--set extract.fps=10`; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

impl ConfigArgs {
    /// The arguments as typed, for a suggested command; begins with a space unless empty.
    pub fn flags(&self) -> String {
        let file = self.config.display().to_string();
        let file = if file == "pipeline.toml" { String::new() } else { format!(" -c {file}") };
        self.set.iter().fold(file, |flags, set| format!("{flags} --set {set}"))
    }

    /// Reads the configuration, or uses the defaults if the default file does not exist.
    pub fn load_or_default(&self) -> anyhow::Result<orator_dataset::config::Config> {
        let is_usual = self.config == std::path::Path::new("pipeline.toml");
        if is_usual && !self.config.exists() {
            orator_dataset::config::load_default(&self.config, &self.set)
        } else {
            self.load()
        }
    }

    /// Reads the configuration and reports all of its problems at once; a key with a former name is noted on standard
    /// error.
    pub fn load(&self) -> anyhow::Result<orator_dataset::config::Config> {
        let config = orator_dataset::config::load(&self.config, &self.set)?;
        config.notes.iter().for_each(|note| crate::cli::ui::note(&format!("note: {note}")));
        Ok(config)
    }
}

/// Device of the networks.
#[derive(clap::Args, Clone, Copy, Debug, Default)]
pub struct DeviceArgs {
    /// Device of the networks: `cpu`, `cuda` (the first NVIDIA GPU), `cuda:N` (GPU N, counted from 0), or `auto` (the
    /// first GPU if it can be used, otherwise the CPU); defaults to `cpu`, in `train` to `work.device`.
    #[arg(long, value_name = "DEVICE")]
    device: Option<DeviceChoice>,
}

impl DeviceArgs {
    /// Opens the device; `cpu_only` returns why the networks run on the CPU only, if they do.
    ///
    /// # Errors
    /// A GPU that cannot be used.
    pub fn open<'a>(
        self,
        default: DeviceChoice,
        cpu_only: impl FnOnce() -> Option<&'a str>,
        ui: &Ui,
    ) -> anyhow::Result<Device> {
        let (device, chosen) = device::open(self.device.unwrap_or(default), cpu_only)?;
        // Without CUDA, the default leaves no choice to report.
        let chosen = chosen.filter(|_| self.device.is_some() || device::has_cuda());
        chosen.iter().for_each(|chosen| ui.say(&format!("device: {chosen}")));
        Ok(device)
    }
}

/// Parses the name of a split.
pub fn split(name: &str) -> Result<Split, String> {
    let found = Split::ALL.into_iter().find(|split| split.name() == name);
    found.ok_or_else(|| "expected train, validation or test".to_owned())
}
