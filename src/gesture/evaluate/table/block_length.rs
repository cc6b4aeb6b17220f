//! How long the blocks of an evaluation are: long enough that the errors of neighbouring blocks hardly depend on each
//! other, and where that allows, short enough that there are some.

use super::decorrelation::integrated_time;

/// A block is at least so many decorrelation times long.
const TIMES: f64 = 1.5;
/// Where the decorrelation time allows it, short motion has this many blocks of 2 to 4 s. Movements of a second must
/// fit.
const N_WANTED: f64 = 16.0;
const BLOCK_SECS: [f64; 2] = [2.0, 4.0];
/// Above an hour of motion blocks become longer, which bounds their number.
const MOST_SECS: f64 = 3600.0;

/// Length of blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockLength {
    /// Seconds.
    pub secs: f64,
    /// Integrated autocorrelation time of the differences between two predictors' errors, seconds.
    pub decorrelation_secs: f64,
}

impl BlockLength {
    /// Length for `secs` of motion at `fps`. `differences`: series that are compared, each in pieces, one number a
    /// frame; the slowest counts.
    pub fn new(secs: f64, fps: f64, differences: &[Vec<Vec<f64>>]) -> Self {
        let times = differences.iter().map(|pieces| integrated_time(pieces));
        let decorrelation_secs = times.fold(1.0, f64::max) / fps;
        let [least, most] = BLOCK_SECS;
        let usual = (secs / N_WANTED).clamp(least, most) * (secs / MOST_SECS).ceil().max(1.0);
        Self { secs: usual.max(TIMES * decorrelation_secs), decorrelation_secs }
    }

    /// Length in frames, at least 1.
    pub fn frames(&self, fps: f64) -> usize {
        ((self.secs * fps).round() as usize).max(1)
    }

    /// How much more the mean of blocks of `block_secs` varies than that of independent ones: `1 + 2 r` with the
    /// correlation r of the means of neighbouring blocks of a first-order autoregression of this decorrelation time.
    pub fn variance_inflation(&self, block_secs: f64) -> f64 {
        // In constants of the exponential decay.
        let length = 2.0 * block_secs / self.decorrelation_secs;
        if length.is_nan() || length <= 1e-3 {
            return 3.0;
        }
        let decay = 1.0 - (-length).exp();
        1.0 + decay * decay / (length - decay)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_errors_make_long_blocks() {
        let series = |period: usize, n: usize| vec![(0..n).map(|t| f64::from((t / period % 2) as u32)).collect()];
        let fast = BlockLength::new(20.0, 15.0, &[series(1, 300)]);
        assert_eq!((fast.secs, fast.frames(15.0)), (2.0, 30));
        assert_eq!(BlockLength::new(60.0, 15.0, &[series(1, 900)]).secs, 3.75);
        assert_eq!(BlockLength::new(7200.0, 15.0, &[]).secs, 8.0);
        let slow = BlockLength::new(20.0, 15.0, &[series(1, 300), series(150, 300)]);
        assert!(slow.secs > 4.0 && slow.secs == 1.5 * slow.decorrelation_secs, "{slow:?}");
    }

    #[test]
    fn long_blocks_are_as_good_as_independent() {
        let length = BlockLength { secs: 2.0, decorrelation_secs: 1.0 };
        // Means of two blocks of 30 frames of an autoregression, from its autocorrelations.
        let (frames, decay): (i32, f64) = (2000, (-4.0 * 2.0 / 2000.0_f64).exp());
        let correlation = |gap: i32| {
            let pairs = (-frames..frames).map(|lag| f64::from(frames - lag.abs()) * decay.powi((lag + gap).abs()));
            pairs.sum::<f64>()
        };
        let expected = 1.0 + 2.0 * correlation(frames) / correlation(0);
        assert!((length.variance_inflation(4.0) - expected).abs() < 1e-3, "{expected}");
        assert!(length.variance_inflation(400.0) < 1.01 && length.variance_inflation(1e-9) == 3.0);
        assert!((length.variance_inflation(1e-2) - 3.0).abs() < 0.1);
    }
}
