//! Generation of motion of a given length, and mismatched sounds and words as inputs for comparison.

use crate::generate::GestureGenerator;
use anyhow::{Result, ensure};
use ndarray::s;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::sound::{SAMPLE_RATE, Sound, sample_at};
use orator_formats::transcript::Word;
use std::ops::Range;

/// Generates motion of exactly `n_frames` frames for a sound, with posture if the network was trained on it.
pub fn motion(speaker: &GestureGenerator, sound: &Sound, n_frames: usize) -> Result<(Motion, Option<Posture>)> {
    let n_needed = sample_at(speaker.fps(), SAMPLE_RATE, n_frames) + 1;
    let mut sound = sound.clone();
    sound.samples.resize(sound.samples.len().max(n_needed), 0.0);
    let (predicted, posture) = speaker.motion_and_posture(&sound)?;
    ensure!(
        predicted.n_frames() >= n_frames,
        "{} frames of motion were generated for {n_frames} frames of audio",
        predicted.n_frames()
    );
    let motion = Motion::from_joints(predicted.fps, predicted.joints.slice(s![..n_frames, .., ..]).to_owned());
    Ok((motion, posture.map(|posture| posture.slice(0..n_frames))))
}

/// Mismatched sound for sound `which` of the same length: the concatenation of all sounds, shifted by half of its
/// length with wrap-around, so that it mostly comes from another video.
///
/// `lengths` are the numbers of samples of all sounds; `read` returns a range of samples of a sound.
///
/// # Errors
/// Errors of `read`.
pub fn mismatched_sound(
    lengths: &[usize],
    which: usize,
    read: impl Fn(usize, Range<usize>) -> Result<Vec<f32>>,
) -> Result<Vec<f32>> {
    let parts = mismatched_parts(lengths, which).into_iter();
    Ok(parts.map(|(sound, range)| read(sound, range)).collect::<Result<Vec<_>>>()?.concat())
}

/// Words of the mismatched sound for sound `which`, with times in that sound; the times in `words` are relative to the
/// start of each sound. Words that are cut by a seam are dropped.
pub fn mismatched_words(lengths: &[usize], rate: u32, words: &[Vec<Word>], which: usize) -> Vec<Word> {
    let secs = |n_samples: usize| n_samples as f64 / f64::from(rate);
    let (mut shifted, mut n_before) = (Vec::new(), 0);
    for (of, range) in mismatched_parts(lengths, which) {
        let (start, end, later) = (secs(range.start), secs(range.end), secs(n_before));
        let inside = words[of].iter().filter(|word| word.start_secs >= start && word.end_secs <= end);
        let moved = |secs: f64| secs - start + later;
        shifted.extend(inside.map(|word| Word {
            start_secs: moved(word.start_secs),
            end_secs: moved(word.end_secs),
            ..word.clone()
        }));
        n_before += range.len();
    }
    shifted
}

/// Sounds and sample ranges that make up the mismatched sound for sound `which`.
fn mismatched_parts(lengths: &[usize], which: usize) -> Vec<(usize, Range<usize>)> {
    let (all, before) = (lengths.iter().sum::<usize>(), lengths[..which].iter().sum::<usize>());
    let mut n_missing = lengths[which];
    let mut skipped = (before + all / 2) % all.max(1);
    let mut parts = Vec::new();
    if n_missing == 0 {
        return parts;
    }
    for (at, &n) in lengths.iter().enumerate().cycle() {
        let start = skipped.min(n);
        let end = n.min(start + n_missing);
        skipped -= start;
        n_missing -= end - start;
        if end > start {
            parts.push((at, start..end));
        }
        if n_missing == 0 {
            break;
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_formats::transcript::WordSource;

    #[test]
    fn mismatched_sounds_have_the_same_length() {
        let all = [vec![1.0, 2.0, 3.0], vec![], vec![4.0, 5.0, 6.0, 7.0]];
        let lengths = all.each_ref().map(Vec::len);
        let read = |at: usize, range: Range<usize>| Ok(all[at][range].to_vec());
        let mismatched_sound: Vec<Vec<f32>> = (0..3).map(|i| mismatched_sound(&lengths, i, read).unwrap()).collect();
        assert_eq!(mismatched_sound, [vec![4.0, 5.0, 6.0], vec![], vec![7.0, 1.0, 2.0, 3.0]]);
        assert!(super::mismatched_sound(&[0], 0, read).unwrap().is_empty());
    }

    #[test]
    fn words_follow_their_sound() {
        let word = |text: &str, start_secs: f64| Word {
            word: text.into(),
            start_secs,
            end_secs: start_secs + 0.5,
            source: WordSource::Given,
            confidence: None,
        };
        let lengths = [4, 2].map(|secs| secs * SAMPLE_RATE as usize);
        let words = [vec![word("a", 0.2), word("cut", 0.8), word("b", 3.2)], vec![word("c", 1.0)]];
        // Shifted by 3 s: the last second of sound 0, all of sound 1, the first second of sound 0.
        let shifted = mismatched_words(&lengths, SAMPLE_RATE, &words, 0);
        let shifted: Vec<(&str, f64)> =
            shifted.iter().map(|word| (word.word.as_str(), (100.0 * word.start_secs).round() / 100.0)).collect();
        assert_eq!(shifted, [("b", 0.2), ("c", 2.0), ("a", 3.2)]);
    }
}
