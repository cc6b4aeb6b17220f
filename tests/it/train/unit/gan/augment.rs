//! Tests of `orator_gesture::train::gan::augment`.

use super::recipe::of_minutes;
use ndarray::{Array2, s};
use orator_base::audio::mel;
use orator_base::types::skeleton::{L_WRIST, N_JOINTS, R_WRIST};
use orator_base::types::time::FrameRate;
use orator_dataset::config::GanRecipe;
use orator_gesture::generate::normalisation::Normalisation;
use orator_gesture::train::gan::augment::{WindowChange, changes, mirror};

fn unchanged() -> WindowChange {
    WindowChange { speed: 1.0, seed: 1, ..WindowChange::default() }
}

fn sound() -> Array2<f32> {
    Array2::from_shape_fn((mel::N_MELS, 100), |(band, t)| (0.1 * band as f32 + 0.05 * t as f32).sin() - 3.0)
}

#[test]
fn changes_are_reproducible_and_within_their_bounds() {
    let (of, fps) = (of_minutes(GanRecipe::Auto, 10.0), FrameRate::new(15, 1));
    let text = |step| format!("{:?}", changes(&of, step, fps));
    assert!(text(3) == text(3) && text(3) != text(4));
    for change in (0..50).flat_map(|step| changes(&of, step, fps)) {
        assert!(change.speed.ln().abs() <= of.augment_speed && change.pitch_bands.abs() <= of.augment_pitch);
        assert!(change.shift_secs.abs() <= 0.5 * fps.secs(of.stride_frames));
        let [first, last] = change.masked_bands;
        assert!(last - first <= of.augment_mask_bands && last <= mel::N_MELS);
    }
    assert!(changes(&of_minutes(GanRecipe::Rebol2021, 10.0), 3, fps).is_empty());
}

#[test]
fn each_change_has_its_effect() {
    let changed = |change: WindowChange| {
        let mut mels = sound();
        change.change_sound(&mut mels);
        mels
    };
    assert_eq!(changed(unchanged()), sound());
    let louder = changed(WindowChange { gain: 0.5, ..unchanged() });
    assert!((&louder - &sound()).iter().all(|gain| (gain - 0.5).abs() < 1e-6));
    let higher = changed(WindowChange { pitch_bands: 2.0, ..unchanged() });
    assert_eq!(higher.row(10), sound().row(8));
    let noisy = changed(WindowChange { noise: 0.1, ..unchanged() });
    assert!(noisy.iter().zip(&sound()).all(|(noisy, own)| noisy > own && noisy - own < 3.0));
    let masked = changed(WindowChange { masked_bands: [4, 9], masked_frames: [10, 20], ..unchanged() });
    let mean = sound().mean().unwrap();
    assert!(masked.slice(s![4..9, ..]).iter().all(|x| *x == mean) && masked[[30, 15]] == mean);
    assert_eq!(masked[[3, 9]], sound()[[3, 9]]);
}

#[test]
fn mirroring_swaps_the_hands_and_is_an_involution() {
    let mean = Array2::from_shape_fn((N_JOINTS, 3), |(joint, k)| 0.01 * joint as f32 - 0.1 * k as f32);
    let std = Array2::from_shape_fn((N_JOINTS, 3), |(joint, k)| 0.1 + 0.001 * (joint + k) as f32);
    let normal = Normalisation::new(&mean, &std, vec![0.1; N_JOINTS - 1]);
    let before = Array2::from_shape_fn((3 * (N_JOINTS - 1), 4), |(i, t)| (i as f32 * 0.3 + t as f32).sin());
    let (mut poses, mut mask) = (before.clone(), Array2::ones(before.dim()));
    mirror(&mut poses, &mut mask, &normal);
    let metres = |of: &Array2<f32>, joint: usize, k: usize| {
        let row = 3 * (joint - 1) + k;
        of[[row, 2]] * normal.std[row] + normal.mean[row]
    };
    assert!((metres(&poses, L_WRIST, 0) + metres(&before, R_WRIST, 0)).abs() < 1e-5);
    assert!((metres(&poses, L_WRIST, 1) - metres(&before, R_WRIST, 1)).abs() < 1e-5);
    mirror(&mut poses, &mut mask, &normal);
    assert!(poses.iter().zip(&before).all(|(a, b)| (a - b).abs() < 1e-4));
}
