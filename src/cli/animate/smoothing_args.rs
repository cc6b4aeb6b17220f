//! Options of smoothing.

use anyhow::{Result, ensure};
use orator_avatar::animate::Smoothing;
use orator_avatar::animate::solve::smoothing::ONE_EURO;
use orator_base::math::one_euro::OneEuro;

#[derive(clap::Args)]
pub struct SmoothingArgs {
    /// As much as the noise of each bone in this clip asks for; cubics over 0.6 s (arms) and 1 s (hands), which come
    /// not late; the causal one-Euro filter; or none.
    #[arg(long, value_enum, default_value = "adaptive")]
    smoothing: SmoothingKind,
    /// Adaptive: factor of the noise that is taken away, 0 for none.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    smoothing_strength: f64,
    /// One-Euro: cut-off of arms at rest, Hz; that of hands is half of it.
    #[arg(long, value_name = "HZ", default_value_t = ONE_EURO.rest_hz)]
    one_euro_hz: f64,
    /// One-Euro: Hz by which the cut-off rises with a radian a second.
    #[arg(long, value_name = "BETA", default_value_t = ONE_EURO.beta)]
    one_euro_beta: f64,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum SmoothingKind {
    Adaptive,
    SavitzkyGolay,
    OneEuro,
    None,
}

impl SmoothingArgs {
    /// Errors on an option of another kind of smoothing than the chosen one.
    pub fn check(&self) -> Result<()> {
        ensure!(
            self.smoothing_strength == 1.0 || self.smoothing == SmoothingKind::Adaptive,
            "--smoothing-strength is for --smoothing adaptive"
        );
        let is_tuned = self.one_euro_hz != ONE_EURO.rest_hz || self.one_euro_beta != ONE_EURO.beta;
        ensure!(
            !is_tuned || self.smoothing == SmoothingKind::OneEuro,
            "--one-euro-hz and --one-euro-beta are for --smoothing one-euro"
        );
        Ok(())
    }

    /// The smoothing that was asked for. Errors: a number out of its range.
    pub fn smoothing(&self) -> Result<Smoothing> {
        Ok(match self.smoothing {
            SmoothingKind::None => Smoothing::None,
            SmoothingKind::Adaptive => {
                let strength = self.smoothing_strength;
                ensure!((0.0..=100.0).contains(&strength), "--smoothing-strength is {strength}, expected 0 to 100");
                Smoothing::Adaptive { strength }
            }
            SmoothingKind::SavitzkyGolay => Smoothing::SavitzkyGolay,
            SmoothingKind::OneEuro => {
                let (rest_hz, beta) = (self.one_euro_hz, self.one_euro_beta);
                ensure!((0.01..=100.0).contains(&rest_hz), "--one-euro-hz is {rest_hz}, expected 0.01 to 100");
                ensure!((0.0..=100.0).contains(&beta), "--one-euro-beta is {beta}, expected 0 to 100");
                Smoothing::OneEuro(OneEuro { rest_hz, beta })
            }
        })
    }
}
