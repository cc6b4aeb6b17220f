//! Loudness of sound.

use orator_base::audio::loudness::integrated;
use orator_base::types::sound::Sound;
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
