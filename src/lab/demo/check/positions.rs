//! Checks whether words with gestures move their hand to the right position, and which frames belong to them.

use ndarray::{Array2, ArrayView3};
use orator_base::math::vec3::Vec3;
use orator_base::types::time::FrameRate;
use orator_dataset::Sample;
use orator_formats::transcript::Word;
use orator_test_support::rule::dataset::SpokenClip;
use orator_test_support::rule::rule::WRISTS;
use orator_test_support::rule::rule::{HOLD, RETURN, RuleGestures, STROKE, WORD_DELAY};
use orator_test_support::rule::speech_dataset;
use orator_test_support::rule::speech_gestures::{self, SpeechGestures};
use orator_test_support::rule::words::{N_TARGETS, WordGesture, gesture};
use serde::Serialize;
use serde::ser::SerializeStruct;

/// Shortest time in seconds to the nearest other word with a gesture for a word to count as isolated.
const ISOLATED_SECS: f64 = 5.0;
/// Two-sided normal quantile of a 95 % interval.
const Z: f64 = 1.96;

/// Counts of words, and of those whose hand at the end of the stroke is nearest to the target of the word.
#[derive(Clone, Copy, Debug, Default)]
pub struct PositionShare {
    pub n_words: usize,
    pub n_correct: usize,
}

/// Correct positions of all words with gestures, and of those without another such word within 5 s.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct WordPositions {
    pub all: PositionShare,
    pub isolated: PositionShare,
}

impl PositionShare {
    /// Expected share of correct positions without knowledge of the word.
    pub const CHANCE: f64 = 1.0 / N_TARGETS as f64;

    fn add(&mut self, is_correct: bool) {
        self.n_words += 1;
        self.n_correct += usize::from(is_correct);
    }

    /// Share of correct positions; 0 if there are no words.
    pub fn share(&self) -> f64 {
        self.n_correct as f64 / self.n_words.max(1) as f64
    }

    /// 95 % interval of the share (Wilson 1927).
    pub fn interval(&self) -> [f64; 2] {
        let (n, share) = (self.n_words.max(1) as f64, self.share());
        let centre = share + Z * Z / (2.0 * n);
        let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
        [-half, half].map(|half| (centre + half) / (1.0 + Z * Z / n))
    }
}

/// The counts, their share and its 95 % interval.
impl Serialize for PositionShare {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct("PositionShare", 4)?;
        fields.serialize_field("n_words", &self.n_words)?;
        fields.serialize_field("n_correct", &self.n_correct)?;
        fields.serialize_field("share", &self.share())?;
        fields.serialize_field("interval", &self.interval())?;
        fields.end()
    }
}

impl WordPositions {
    /// Counts the words of a clip of the first rule for predicted joints [T, 49, 3], metres, relative to the neck.
    pub fn count(&mut self, clip: &SpokenClip, predicted: ArrayView3<f32>, fps: FrameRate) {
        let (speech, words) = (clip.speech(), clip.words());
        let rule = RuleGestures::of_habits(&clip.habits(), &speech, &words);
        let stroke = |word: &Word| gesture(&word.word).map(|gesture| (word.start_secs, gesture));
        let strokes: Vec<(f64, WordGesture)> = words.iter().filter_map(stroke).collect();
        self.add(&strokes, WORD_DELAY + STROKE, |of, secs| rule.wrist_at(of, secs), predicted, fps);
    }

    /// Counts the words of a clip of the second rule.
    pub fn count_speech(&mut self, sample: &Sample, predicted: ArrayView3<f32>, fps: FrameRate) {
        let events = speech_dataset::events(sample);
        let rule = SpeechGestures::new(&events);
        let strokes: Vec<(f64, WordGesture)> =
            events.words.iter().map(|(start, target)| (*start, WordGesture { hand: 0, target: *target })).collect();
        let delay = speech_gestures::WORD_DELAY + speech_gestures::STROKE;
        self.add(&strokes, delay, |of, secs| rule.wrist_at(of.target, secs), predicted, fps);
    }

    /// Adds the strokes of words, each with the start of its word in seconds, `delay` seconds before its end; `wrist_at`
    /// is the position of the wrist at a target.
    fn add(
        &mut self,
        strokes: &[(f64, WordGesture)],
        delay: f64,
        wrist_at: impl Fn(WordGesture, f64) -> Vec3,
        predicted: ArrayView3<f32>,
        fps: FrameRate,
    ) {
        for (n, (start, own)) in strokes.iter().enumerate() {
            let t = ((start + delay) * fps.per_sec()).round() as usize;
            if t >= predicted.shape()[0] {
                continue;
            }
            let wrist: [f64; 3] = std::array::from_fn(|k| f64::from(predicted[[t, WRISTS[own.hand], k]]));
            let distance = |target: &usize| -> f64 {
                let at = wrist_at(WordGesture { target: *target, ..*own }, fps.secs(t));
                (0..3).map(|k| (wrist[k] - at[k]).powi(2)).sum()
            };
            let nearest = (0..N_TARGETS).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let is_correct = nearest == Some(own.target);
            self.all.add(is_correct);
            let is_near = |m: usize| strokes.get(m).is_some_and(|(other, _)| (other - start).abs() <= ISOLATED_SECS);
            if !is_near(n + 1) && !n.checked_sub(1).is_some_and(is_near) {
                self.isolated.add(is_correct);
            }
        }
    }
}

/// Steps between frames [T - 1, 2] in which no word moves the left or the right hand.
pub fn without_words(clip: &SpokenClip, fps: FrameRate) -> Array2<bool> {
    let mut steps = Array2::from_elem((clip.n_frames.saturating_sub(1), 2), true);
    for word in clip.words() {
        let Some(WordGesture { hand, .. }) = gesture(&word.word) else { continue };
        let start = word.start_secs + WORD_DELAY;
        let of_word = |t: usize| (start - fps.secs(1)..start + STROKE + HOLD + RETURN).contains(&fps.secs(t));
        steps.column_mut(hand).iter_mut().enumerate().for_each(|(t, is_beat)| *is_beat &= !of_word(t));
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::types::split::Split;
    use orator_test_support::rule::dataset::RULE_OF_WORDS;

    #[test]
    fn the_rule_is_correct_and_motion_without_words_is_at_chance() {
        let fps = FrameRate::new(15, 1);
        let (mut of_rule, mut without_words) = (WordPositions::default(), WordPositions::default());
        for number in 0..12 {
            let clip =
                SpokenClip { rule: RULE_OF_WORDS, seed: 1, split: Split::Test, number, n_frames: 900, habits: 0 };
            of_rule.count(&clip, clip.predictable().joints.view(), fps);
            let beats = RuleGestures::of_habits(&clip.habits(), &clip.speech(), &[]).motion(clip.n_frames, fps);
            without_words.count(&clip, beats.joints.view(), fps);
        }
        assert!(of_rule.all.n_words > 80 && of_rule.isolated.n_words > 10, "{of_rule:?}");
        assert!(of_rule.all.share() == 1.0 && of_rule.isolated.share() == 1.0, "{of_rule:?}");
        let [low, high] = without_words.all.interval();
        assert!(low < PositionShare::CHANCE && PositionShare::CHANCE < high, "{without_words:?}");
    }

    #[test]
    fn an_interval_is_wilsons() {
        // Wilson's interval of 8 of 10, as published tables give it.
        let [low, high] = PositionShare { n_words: 10, n_correct: 8 }.interval();
        assert!((low - 0.490).abs() < 1e-3 && (high - 0.943).abs() < 1e-3, "{low} {high}");
    }
}
