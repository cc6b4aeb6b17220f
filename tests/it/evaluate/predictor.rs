//! Baseline predictors.

use orator_base::types::sound::SAMPLE_RATE;
use orator_formats::transcript::{Word, WordSource};
use orator_gesture::evaluate::baseline::predictor::{mismatched_sound, mismatched_words};
use std::ops::Range;

#[test]
fn mismatched_sounds_have_the_same_length() {
    let all = [vec![1.0, 2.0, 3.0], vec![], vec![4.0, 5.0, 6.0, 7.0]];
    let lengths = all.each_ref().map(Vec::len);
    let read = |at: usize, range: Range<usize>| Ok(all[at][range].to_vec());
    let mismatched_sound: Vec<Vec<f32>> = (0..3).map(|i| mismatched_sound(&lengths, i, read).unwrap()).collect();
    assert_eq!(mismatched_sound, [vec![4.0, 5.0, 6.0], vec![], vec![7.0, 1.0, 2.0, 3.0]]);
    assert!(orator_gesture::evaluate::baseline::predictor::mismatched_sound(&[0], 0, read).unwrap().is_empty());
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
