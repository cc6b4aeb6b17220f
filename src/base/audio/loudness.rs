//! Perceived loudness of speech: integrated loudness of one channel by ITU-R BS.1770-4 (EBU R 128), in LUFS.

use crate::types::sound::Sound;
use ebur128::{EbuR128, Mode};

/// Measures the integrated loudness in LUFS; `None` for a sound that is silent throughout. A sound shorter than one
/// block of 0.4 s is measured as one block.
pub fn integrated(sound: &Sound) -> Option<f64> {
    let block = 4 * ((sound.rate as usize + 5) / 10);
    let n = sound.samples.len();
    let mut meter = EbuR128::new(1, sound.rate, Mode::I).ok()?;
    meter.add_frames_f32(&sound.samples).ok()?;
    meter.add_frames_f32(&vec![0.0; block.saturating_sub(n)]).ok()?;
    // Compensates for the zeros that pad a short sound.
    let share = n as f64 / n.max(block) as f64;
    let lufs = meter.loudness_global().ok()? - 10.0 * share.log10();
    lufs.is_finite().then_some(lufs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Sine of 997 Hz at successive levels, given as (dB of full scale, seconds).
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
    fn a_full_scale_sine_is_three_db_below_full_scale() {
        // ITU-R BS.1770-4, annex 1: a sine of 0 dB FS at 997 Hz in one channel measures -3.01.
        for rate in [48_000, 44_100, 16_000] {
            let found = integrated(&sine(rate, &[(0.0, 3.0)])).unwrap();
            assert!((found + 3.01).abs() < 0.06, "{rate} Hz: {found}");
        }
    }

    #[test]
    fn pauses_and_soft_parts_are_ignored() {
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
