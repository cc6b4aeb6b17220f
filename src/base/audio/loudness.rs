//! Loudness of speech as listeners judge it: the integrated loudness of ITU-R BS.1770-4 (which EBU R 128 uses) of one
//! channel, LUFS. The two filters of its K-weighting are designed for any rate by the bilinear transform; at 48 kHz they
//! have the coefficients of the recommendation.

use crate::types::sound::Sound;
use std::f64::consts::PI;

/// Length of a block and the step from one to the next, seconds.
const BLOCK_SECS: f64 = 0.4;
const STEP_SECS: f64 = 0.1;
/// Blocks below this loudness, LUFS, and then below the mean of the others by this much, LU, are pauses.
const SILENCE_LUFS: f64 = -70.0;
const PAUSE_LU: f64 = -10.0;
/// Loudness of a mean square of 1, LUFS.
const OFFSET: f64 = -0.691;
/// Shelf that stands for the head: frequency in Hz, quality, gain in dB, and the gain's share at that frequency.
const SHELF: (f64, f64, f64, f64) =
    (1_681.974_450_955_533, 0.707_175_236_955_419_6, 3.999_843_853_973_347, 0.499_666_774);
/// High pass: frequency in Hz, quality.
const HIGH_PASS: (f64, f64) = (38.135_470_876_024_44, 0.500_327_037_323_877_3);

/// Integrated loudness in LUFS; `None` for a sound that is silent throughout.
pub fn integrated(sound: &Sound) -> Option<f64> {
    let rate = f64::from(sound.rate);
    let [mut shelf, mut high_pass] = k_weighting(rate);
    let squares: Vec<f64> =
        sound.samples.iter().map(|&sample| high_pass.next(shelf.next(f64::from(sample))).powi(2)).collect();
    let samples = |secs: f64| ((secs * rate).round() as usize).max(1);
    let block = samples(BLOCK_SECS).min(squares.len().max(1));
    let blocks: Vec<f64> =
        squares.windows(block).step_by(samples(STEP_SECS)).map(|block| mean(block.iter().copied())).collect();
    let above = |least_lufs: f64| {
        let kept = || blocks.iter().copied().filter(|square| lufs(*square) > least_lufs);
        kept().next().map(|_| mean(kept()))
    };
    let level = lufs(above(SILENCE_LUFS)?) + PAUSE_LU;
    above(level.max(SILENCE_LUFS)).map(lufs)
}

fn lufs(mean_square: f64) -> f64 {
    OFFSET + 10.0 * mean_square.log10()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    sum / n
}

/// Filter of second order, `a[0]` being 1.
struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
    state: [f64; 2],
}

impl Biquad {
    fn next(&mut self, x: f64) -> f64 {
        let y = self.b[0] * x + self.state[0];
        self.state = [self.b[1] * x - self.a[0] * y + self.state[1], self.b[2] * x - self.a[1] * y];
        y
    }
}

/// The two filters at `rate` samples a second.
fn k_weighting(rate: f64) -> [Biquad; 2] {
    let filter = |hz: f64, quality: f64, [high, middle, low]: [f64; 3]| {
        let k = (PI * hz / rate).tan();
        let (damped, square) = (k / quality, k * k);
        let a0 = 1.0 + damped + square;
        Biquad {
            b: [
                (high + middle * damped + low * square) / a0,
                2.0 * (low * square - high) / a0,
                (high - middle * damped + low * square) / a0,
            ],
            a: [2.0 * (square - 1.0) / a0, (1.0 - damped + square) / a0],
            state: [0.0; 2],
        }
    };
    let (hz, quality, gain_db, share) = SHELF;
    let gain = 10f64.powf(gain_db / 20.0);
    let shelf = filter(hz, quality, [gain, gain.powf(share), 1.0]);
    let mut high_pass = filter(HIGH_PASS.0, HIGH_PASS.1, [1.0, 0.0, 0.0]);
    // The recommendation leaves this filter's gain at 1 before the division.
    high_pass.b = [1.0, -2.0, 1.0];
    [shelf, high_pass]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Sine of 997 Hz, levels in dB below full scale with their seconds.
    fn sine(rate: u32, levels: &[(f64, f64)]) -> Sound {
        let mut samples = Vec::new();
        for &(db, secs) in levels {
            let n = (secs * f64::from(rate)) as usize;
            let gain = 10f64.powf(db / 20.0);
            let from = samples.len();
            samples.extend((from..from + n).map(|i| (gain * (TAU * 997.0 * i as f64 / f64::from(rate)).sin()) as f32));
        }
        Sound { rate, samples }
    }

    #[test]
    fn the_filters_are_those_of_the_recommendation() {
        // ITU-R BS.1770-4, tables 1 and 2.
        let [shelf, high_pass] = k_weighting(48_000.0);
        let expected = [1.535_124_859_586_97, -2.691_696_189_406_38, 1.198_392_810_852_85];
        for (found, expected) in shelf.b.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-7, "{found} {expected}");
        }
        let expected = [-1.690_659_293_182_41, 0.732_480_774_215_85, -1.990_047_454_833_98, 0.990_072_250_366_21];
        for (found, expected) in shelf.a.iter().chain(&high_pass.a).zip(expected) {
            assert!((found - expected).abs() < 1e-7, "{found} {expected}");
        }
    }

    #[test]
    fn a_full_sine_has_three_db_less_than_full_scale() {
        // ITU-R BS.1770-4, annex 1: 0 dB FS at 997 Hz in one channel reads -3.01.
        for rate in [48_000, 44_100, 16_000] {
            let found = integrated(&sine(rate, &[(0.0, 3.0)])).unwrap();
            assert!((found + 3.01).abs() < 0.06, "{rate} Hz: {found}");
        }
    }

    #[test]
    fn pauses_and_soft_parts_do_not_count() {
        // EBU Tech 3341, cases 3 and 4 (there two channels, 3.01 LU louder).
        for levels in [
            &[(-36.0, 10.0), (-23.0, 60.0), (-36.0, 10.0)][..],
            &[(-72.0, 10.0), (-36.0, 10.0), (-23.0, 60.0), (-36.0, 10.0), (-72.0, 10.0)],
        ] {
            let found = integrated(&sine(48_000, levels)).unwrap();
            assert!((found + 26.01).abs() < 0.1, "{found}");
        }
        assert_eq!(integrated(&sine(16_000, &[(-80.0, 2.0)])), None);
        assert_eq!(integrated(&Sound { rate: 16_000, samples: Vec::new() }), None);
        let short = integrated(&sine(16_000, &[(-20.0, 0.2)])).unwrap();
        assert!((short + 23.0).abs() < 0.5, "{short}");
    }
}
