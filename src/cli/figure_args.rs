//! Options of the figure in files that `orator animate` and `orator generate` write.

use super::outputs::OutputFiles;
use anyhow::{Result, ensure};
use orator_avatar::animate::export::file::{ExportFormat, FigureOptions};
use orator_avatar::animate::rig::names::Names;
use orator_base::types::time::FrameRate;

#[derive(clap::Args)]
pub(super) struct FigureArgs {
    /// Naming convention of the bones in .bvh, .fbx, .glb and .json.
    #[arg(long, value_name = "own|mixamo|unity-humanoid|vrm|unreal", default_value = "own", value_parser = parse_names)]
    names: Names,
    /// Frame rate of the output, frames per second, such as 30 or 30000/1001; defaults to the rate of the motion, and
    /// for .mp4 to its smallest multiple of at least 30.
    #[arg(long, value_name = "RATE")]
    fps: Option<FrameRate>,
}

impl FigureArgs {
    /// The parsed options.
    pub(super) fn options(&self) -> FigureOptions {
        FigureOptions { names: self.names, fps: self.fps }
    }

    /// Checks that one of the files uses bone names if a naming convention is given.
    pub(super) fn check(&self, outputs: &OutputFiles) -> Result<()> {
        self.check_formats(outputs.iter().map(|(_, format)| *format))
    }

    /// The check of `check`, for formats.
    pub(super) fn check_formats(&self, mut formats: impl Iterator<Item = ExportFormat>) -> Result<()> {
        let is_named = formats.any(ExportFormat::has_names);
        ensure!(
            is_named || self.names == Names::Own,
            "--names applies to .bvh, .fbx, .glb and .json only: write one of these formats, or omit --names"
        );
        Ok(())
    }
}

fn parse_names(label: &str) -> Result<Names, String> {
    let known = || Names::ALL.map(Names::label).join(", ");
    Names::ALL.into_iter().find(|names| names.label() == label).ok_or_else(|| format!("expected one of {}", known()))
}
