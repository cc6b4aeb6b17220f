//! Motion that a trained speaker generates for a sound of a given length.

use crate::generate::GestureGenerator;
use crate::types::pose3d::Motion;
use crate::types::sound::{SAMPLE_RATE, Sound};
use crate::types::sync;
use anyhow::{Result, ensure};
use ndarray::s;

/// Generated motion for one sound, exactly `n_frames` long.
pub fn motion(speaker: &GestureGenerator, sound: &Sound, n_frames: usize) -> Result<Motion> {
    let wanted = sync::sample_at(speaker.fps(), SAMPLE_RATE, n_frames) + 1;
    let mut sound = sound.clone();
    sound.samples.resize(sound.samples.len().max(wanted), 0.0);
    let predicted = speaker.motion(&sound)?;
    ensure!(predicted.n_frames() >= n_frames, "{} frames of motion for {n_frames} of sound", predicted.n_frames());
    Ok(Motion::from_joints(predicted.fps, predicted.joints.slice(s![..n_frames, .., ..]).to_owned()))
}

/// Mismatched sound for sound `which`, as long as it: what follows half of all sounds later, with wrap-around, and so
/// most often another video.
pub fn turned(sounds: &[&Sound], which: usize) -> Sound {
    let length = |sounds: &[&Sound]| sounds.iter().map(|sound| sound.samples.len()).sum::<usize>();
    let (all, before) = (length(sounds), length(&sounds[..which]));
    let (own, n) = (sounds[which], sounds[which].samples.len());
    let mut skipped = (before + all / 2) % all.max(1);
    let mut samples = Vec::with_capacity(n);
    for sound in sounds.iter().cycle().take_while(|_| n > 0) {
        let rest = sound.samples.get(skipped..).unwrap_or_default();
        skipped -= sound.samples.len() - rest.len();
        samples.extend(rest.iter().take(n - samples.len()));
        if samples.len() == n {
            break;
        }
    }
    Sound { rate: own.rate, samples }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sound_becomes_another_one_of_its_length() {
        let sound = |samples: &[f32]| Sound { rate: SAMPLE_RATE, samples: samples.to_vec() };
        let all = [sound(&[1.0, 2.0, 3.0]), sound(&[]), sound(&[4.0, 5.0, 6.0, 7.0])];
        let all: Vec<&Sound> = all.iter().collect();
        let turned: Vec<Sound> = (0..3).map(|i| turned(&all, i)).collect();
        assert_eq!(turned, [sound(&[4.0, 5.0, 6.0]), sound(&[]), sound(&[7.0, 1.0, 2.0, 3.0])]);
        assert_eq!(super::turned(&[&sound(&[])], 0), sound(&[]));
    }
}
