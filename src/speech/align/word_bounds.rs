//! Corrections of word times: the delay of the network, and silence at the start and end of a word.

use crate::recognised::RecognisedWord;
use ndarray::ArrayView2;

/// Seconds of a frame of the spectrogram.
const MEL_SECS: f64 = 0.01;
/// Level between the quiet (5 %) and the loud frames (95 %) of a window, above which a frame is no silence.
const LOUD: f32 = 0.25;
/// Number of silent frames that are removed from a word; closures of plosives are shorter.
const MIN_SILENCE: usize = 5;
/// Length of the longest word, seconds, and seconds per letter.
const MAX_SECS: (f64, f64) = (0.4, 0.12);

/// Delay of the network and loudness of a window.
pub(crate) struct WordBounds {
    delay_secs: f64,
    /// Of each frame of the spectrogram.
    is_loud: Vec<bool>,
}

impl WordBounds {
    /// `mel` is the spectrogram [bands, frames].
    pub(crate) fn new(mel: ArrayView2<f32>, delay_secs: f64) -> Self {
        let levels: Vec<f32> = mel.columns().into_iter().map(|column| column.sum()).collect();
        let mut sorted = levels.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let [quiet, loud] = [5, 95].map(|percent| sorted.get(sorted.len() * percent / 100).copied().unwrap_or(0.0));
        let is_loud = levels.into_iter().map(|level| level > quiet + LOUD * (loud - quiet)).collect();
        Self { delay_secs, is_loud }
    }

    /// Corrects the times of a word, in seconds of the window.
    pub(crate) fn correct(&self, word: &mut RecognisedWord) {
        let n_frames = self.is_loud.len();
        let frame = |secs: f64| (((secs - self.delay_secs) / MEL_SECS).round().max(0.0) as usize).min(n_frames);
        let (mut start, mut end) = (frame(word.start_secs), frame(word.end_secs));
        let is_loud = self.is_loud.get(start..end).unwrap_or(&[]);
        let loud = is_loud.iter().position(|&is_loud| is_loud).zip(is_loud.iter().rposition(|&is_loud| is_loud));
        if let Some((first, last)) = loud {
            let n_quiet = is_loud.len() - 1 - last;
            start += if first >= MIN_SILENCE { first } else { 0 };
            end -= if n_quiet >= MIN_SILENCE { n_quiet } else { 0 };
        }
        let (start_secs, end_secs) = (start as f64 * MEL_SECS, end as f64 * MEL_SECS);
        // A pause that is not silent belongs to the next word.
        let n_letters = word.word.chars().filter(|letter| letter.is_alphanumeric()).count();
        let max_secs = MAX_SECS.0 + MAX_SECS.1 * n_letters as f64;
        (word.start_secs, word.end_secs) = (start_secs.max(end_secs - max_secs), end_secs.max(start_secs));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    #[test]
    fn words_exclude_the_silence_around_them_and_the_delay() {
        // Sound from 1 s to 2 s, with a closure of 40 ms at 1.06 s, and from 3 s to 6 s.
        let is_loud =
            |frame: usize| (100..200).contains(&frame) && !(106..110).contains(&frame) || (300..600).contains(&frame);
        let mel = Array2::from_shape_fn((80, 700), |(_, frame)| if is_loud(frame) { 1.0 } else { -0.5 });
        let bounds = WordBounds::new(mel.view(), 0.1);
        let corrected = |start_secs, end_secs| {
            let mut word = RecognisedWord { word: "word".to_owned(), start_secs, end_secs, probability: 1.0 };
            bounds.correct(&mut word);
            [word.start_secs, word.end_secs].map(|secs| (secs * 100.0).round() as i64)
        };
        assert_eq!(corrected(0.6, 1.5), [100, 140]);
        assert_eq!(corrected(1.16, 1.9), [106, 180]);
        assert_eq!(corrected(1.4, 2.9), [130, 200]);
        assert_eq!(corrected(0.05, 0.3), [0, 20]);
        // Words of four letters have at most 0.88 s.
        assert_eq!(corrected(3.5, 6.0), [502, 590]);
        assert_eq!(corrected(9.0, 8.0), [700, 700]);
        let none = WordBounds::new(Array2::zeros((80, 0)).view(), f64::NAN);
        let mut word = RecognisedWord { word: String::new(), start_secs: f64::NAN, end_secs: 1.0, probability: 0.0 };
        none.correct(&mut word);
        assert_eq!((word.start_secs, word.end_secs), (0.0, 0.0));
    }
}
