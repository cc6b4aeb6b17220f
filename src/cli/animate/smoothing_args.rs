//! Options of smoothing.

use anyhow::{Result, ensure};
use orator_avatar::animate::Smoothing;

#[derive(clap::Args)]
pub(super) struct SmoothingArgs {
    /// As much as the noise of each bone in this clip asks for; cubics over 0.6 s (arms) and 1 s (hands), without delay;
    /// or none.
    #[arg(long, value_enum, default_value = "adaptive")]
    smoothing: SmoothingKind,
    /// Adaptive: factor of the noise that is taken away, 0 for none.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    smoothing_strength: f64,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum SmoothingKind {
    Adaptive,
    SavitzkyGolay,
    None,
}

impl SmoothingArgs {
    /// The smoothing that was asked for. Errors: a strength out of its range, or of another kind of smoothing.
    pub(super) fn smoothing(&self) -> Result<Smoothing> {
        let strength = self.smoothing_strength;
        ensure!(
            strength == 1.0 || self.smoothing == SmoothingKind::Adaptive,
            "--smoothing-strength is for --smoothing adaptive"
        );
        ensure!((0.0..=100.0).contains(&strength), "--smoothing-strength is {strength}, expected 0 to 100");
        Ok(match self.smoothing {
            SmoothingKind::None => Smoothing::None,
            SmoothingKind::Adaptive => Smoothing::Adaptive { strength },
            SmoothingKind::SavitzkyGolay => Smoothing::SavitzkyGolay,
        })
    }
}
