//! Words of the synthetic speaker, which are independent of the audio: some of them move a hand to a specific target.

use crate::drawn::speech::Speech;
use orator_base::types::split::Split;
use orator_formats::transcript::{Word, WordSource};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Shortest interval between the starts of two words with gestures, seconds.
const MIN_INTERVAL: f64 = 1.5;
/// Probability of such a word where one is allowed.
const GESTURE_PROBABILITY: f64 = 0.12;
/// Largest number of syllables of a word.
const MAX_SYLLABLES: usize = 3;
/// Number of targets per hand.
pub const N_TARGETS: usize = 4;

/// Words that move the left and right hand to each of their targets.
const GESTURES: [[&str; N_TARGETS]; 2] = [["over", "away", "deep", "self"], ["high", "aside", "low", "here"]];
/// All other words.
const OTHERS: &str = "the of and a to in is you that it he was for on are as with his they I at be this have from or one \
    had by word but not what all were we when your can said there use an each which she do how their if will other about \
    out many then them these so some her would make like him into time has look two more write go see number no way could \
    people my than first water been call who oil its now find long down day did get come made may part sound take only \
    little work know place year live me back give most very after thing our just name good sentence man think say great \
    where help through much before line right too mean old any same tell boy follow came want show also around form three \
    small set put end does another well large must big even such because turn here's why ask went men read need land \
    different home us move try kind hand picture again change off play spell air animal house point page letter mother \
    answer found study still learn should world";
/// Pairs of a word with a gesture and a neighbouring word are divided into this many classes; one of them is reserved
/// for the held-out splits.
const PAIR_CLASSES: usize = 5;

/// Gesture of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WordGesture {
    /// 0: left, 1: right.
    pub hand: usize,
    /// Index of the target, below [`N_TARGETS`].
    pub target: usize,
}

/// Gesture of a word; `None` if it has none.
pub fn gesture(word: &str) -> Option<WordGesture> {
    let of_hand = |hand: usize| GESTURES[hand].iter().position(|own| *own == word);
    (0..2).find_map(|hand| of_hand(hand).map(|target| WordGesture { hand, target }))
}

/// Words for the syllables of a speech, one to three syllables each, drawn independently of the syllables. Training
/// and held-out splits share no pair of a word with a gesture and a neighbouring word.
pub fn words(speech: &Speech, split: Split, rng: &mut ChaCha8Rng) -> Vec<Word> {
    let mut spans: Vec<[f64; 2]> = Vec::new();
    for phrase in &speech.phrases {
        let mut at = phrase.first;
        while at < phrase.last {
            let next = (at + rng.random_range(1..=MAX_SYLLABLES)).min(phrase.last);
            spans.push([speech.syllables[at].start, speech.syllables[next - 1].end]);
            at = next;
        }
    }
    let mut chosen: Vec<&str> = Vec::with_capacity(spans.len());
    let mut last = None;
    for (n, [start, _]) in spans.iter().enumerate() {
        let is_allowed = last.is_none_or(|last: usize| n > last + 2 && start - spans[last][0] >= MIN_INTERVAL);
        let is_gesture = rng.random_bool(GESTURE_PROBABILITY) && is_allowed;
        last = if is_gesture { Some(n) } else { last };
        chosen.push(if is_gesture { GESTURES[rng.random_range(0..2)][rng.random_range(0..N_TARGETS)] } else { "" });
    }
    let others: Vec<&str> = OTHERS.split_whitespace().collect();
    for n in 0..chosen.len() {
        if chosen[n].is_empty() {
            let neighbours = [n.checked_sub(1).map(|before| chosen[before]), chosen.get(n + 1).copied()];
            let fits = |other: usize| neighbours.iter().flatten().all(|word| is_of_split(word, other, split));
            let fitting: Vec<usize> = (0..others.len()).filter(|other| fits(*other)).collect();
            chosen[n] = others[fitting[rng.random_range(0..fitting.len())]];
        }
    }
    let word = |(word, [start_secs, end_secs]): (&str, [f64; 2])| Word {
        word: word.to_owned(),
        start_secs,
        end_secs,
        source: WordSource::Given,
        confidence: None,
    };
    chosen.into_iter().zip(spans).map(word).collect()
}

/// Whether the pair of `word` and the other word with index `other` belongs to the split; true for a word without
/// gesture.
fn is_of_split(word: &str, other: usize, split: Split) -> bool {
    let Some(WordGesture { hand, target }) = gesture(word) else { return true };
    let is_held_out = (3 * (N_TARGETS * hand + target) + other).is_multiple_of(PAIR_CLASSES);
    is_held_out == (split != Split::Train)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use std::collections::BTreeSet;

    fn of_split(split: Split, seed: u64) -> Vec<Word> {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let speech = Speech::free(600.0, rng);
        words(&speech, split, rng)
    }

    #[test]
    fn splits_share_no_pair_of_a_gesture_word_and_its_neighbour() {
        let pairs = |words: &[Word]| -> BTreeSet<(String, String)> {
            let of_two = |two: &[Word]| {
                let is_one = two.iter().any(|word| gesture(&word.word).is_some());
                is_one.then(|| (two[0].word.clone(), two[1].word.clone()))
            };
            words.windows(2).filter_map(of_two).collect()
        };
        let (train, test) = (of_split(Split::Train, 1), of_split(Split::Test, 2));
        assert!(pairs(&train).len() > 100 && pairs(&train).is_disjoint(&pairs(&test)));
    }

    #[test]
    fn gesture_words_are_spaced_and_all_occur() {
        let words = of_split(Split::Train, 3);
        let strokes: Vec<&Word> = words.iter().filter(|word| gesture(&word.word).is_some()).collect();
        assert!(strokes.windows(2).all(|two| two[1].start_secs - two[0].start_secs >= MIN_INTERVAL));
        let different: BTreeSet<&str> = strokes.iter().map(|word| word.word.as_str()).collect();
        assert_eq!(different.len(), 2 * N_TARGETS);
        assert!(words.iter().all(|word| word.end_secs > word.start_secs && !word.word.is_empty()));
        let others: BTreeSet<&str> = OTHERS.split_whitespace().collect();
        assert_eq!(others.len(), OTHERS.split_whitespace().count(), "duplicate word");
        assert!(others.iter().all(|other| gesture(other).is_none()));
    }
}
