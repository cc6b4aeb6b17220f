//! Tests of `orator_base::math::local_fit`.

use orator_base::math::local_fit::LocalFit;
use orator_base::math::vec3::{Vec3, add, norm, scale, sub};

const FPS: f64 = 30.0;

/// White noise of unit variance: sums of twelve numbers of a linear congruential generator.
fn white(n: usize) -> Vec<Vec3> {
    let mut state = 1u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 31)
    };
    (0..n).map(|_| [0, 1, 2].map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0)).collect()
}

fn rms(a: &[Vec3], b: &[Vec3]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| norm(sub(*a, *b)).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

/// An arm that rests, falls by 15 degrees within 0.12 s and returns, as unit vectors.
fn beat() -> Vec<Vec3> {
    let angle = |t: usize| {
        let at = ((t as f64 / FPS - 2.0) / 0.12).clamp(-1.0, 1.0);
        15f64.to_radians() * (1.0 + (std::f64::consts::PI * at).cos()) / 2.0
    };
    (0..120).map(angle).map(|angle| [angle.cos(), -angle.sin(), 0.0]).collect()
}

#[test]
fn parabolic_motion_and_short_runs_are_unchanged() {
    let parabola: Vec<Vec3> = (0..60).map(|t| [0.1 * f64::from(t), 0.01 * f64::from(t * t), -3.0]).collect();
    assert!(rms(&LocalFit::new(FPS, 1.0, 0.01).run(&parabola, &[]), &parabola) < 1e-9);
    for n in 0..3 {
        assert_eq!(LocalFit::new(FPS, 1.0, 0.0).run(&white(60)[..n], &[]).len(), n);
    }
}

#[test]
fn a_fast_beat_keeps_its_apex_and_its_energy() {
    let beat = beat();
    let smooth = LocalFit::new(FPS, 1.0, 0.005).run(&beat, &[]);
    let fall = |track: &[Vec3]| track.iter().map(|v| v[1]).fold(0.0, f64::min);
    let energy = |track: &[Vec3]| track.windows(2).map(|pair| norm(sub(pair[1], pair[0])).powi(2)).sum::<f64>();
    // 5 mm at the end of a 0.6 m arm.
    assert!((fall(&smooth) - fall(&beat)).abs() < 0.005 / 0.6, "{} of {}", fall(&smooth), fall(&beat));
    assert!(energy(&smooth) > 0.95 * energy(&beat), "{}", energy(&smooth) / energy(&beat));
}

#[test]
fn noise_is_removed_and_the_beat_is_retained() {
    let beat: Vec<Vec3> = beat().repeat(3);
    let noisy: Vec<Vec3> = beat.iter().zip(white(beat.len())).map(|(v, e)| add(*v, scale(e, 0.01))).collect();
    let smooth = LocalFit::new(FPS, 1.0, 0.0).run(&noisy, &[]);
    let (before, after) = (rms(&noisy, &beat), rms(&smooth, &beat));
    assert!(after < 0.62 * before, "{before} -> {after}");
}
