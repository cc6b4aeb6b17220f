//! Words of tokens and their times.

use super::token_times::{FRAME_SECS, TokenTimes};
use crate::recognised::{RecognisedSegment, RecognisedWord};
use crate::tokenizer::Tokenizer;

/// Languages that are written without spaces between words; each character is a word.
pub(crate) const WITHOUT_SPACES: [&str; 6] = ["zh", "ja", "th", "lo", "my", "yue"];
/// Marks that end a sentence.
const SENTENCE_ENDS: [char; 6] = ['.', '\u{3002}', '!', '\u{ff01}', '?', '\u{ff1f}'];
/// Median length of words, at most, seconds.
const MAX_MEDIAN_SECS: f64 = 0.7;
/// Difference of a word's time from that of its segment, from which the segment's is preferred, seconds.
const SEGMENT_SECS: f64 = 0.5;

/// Words of tokens whose first is number `first` of `times`, in seconds of the window. A word extends over its tokens
/// with letters or digits, so that pauses at its punctuation are no part of it; without any, it is left out.
pub(crate) fn words_of(
    tokenizer: &Tokenizer,
    language: &str,
    tokens: &[u32],
    times: &TokenTimes,
    first: usize,
) -> Vec<RecognisedWord> {
    let (mut words, mut at): (Vec<(String, Vec<usize>)>, usize) = (Vec::new(), first);
    for (text, n_tokens) in tokenizer.pieces(tokens) {
        let is_spoken = text.chars().any(char::is_alphanumeric);
        let is_start = text.starts_with(char::is_whitespace) || is_spoken && WITHOUT_SPACES.contains(&language);
        match words.last_mut() {
            // An opening mark before the first letter belongs to the word.
            Some((word, tokens)) if !is_start || tokens.is_empty() && !text.starts_with(char::is_whitespace) => {
                word.push_str(&text);
                tokens.extend((at..at + n_tokens).filter(|_| is_spoken));
            }
            _ => words.push((text, (at..at + n_tokens).filter(|_| is_spoken).collect())),
        }
        at += n_tokens;
    }
    let timed = words.into_iter().filter_map(|(word, tokens)| {
        let secs = |token: usize| times.start(token) as f64 * FRAME_SECS;
        let (start_secs, end_secs) = (secs(*tokens.first()?), secs(tokens.last()? + 1));
        let probability = times.mean_probability(tokens.into_iter());
        Some(RecognisedWord { word: word.trim().to_owned(), start_secs, end_secs, probability })
    });
    timed.collect()
}

/// Shortens words that contain a pause: the first word after a sentence, and the words at the ends of segments, whose
/// timestamps are more reliable there; other segments end with their words. `last_secs` is the end of the speech before.
pub(crate) fn shorten_long_words(segments: &mut [RecognisedSegment], mut last_secs: f64) {
    let lengths = segments.iter().flat_map(|segment| &segment.words).map(RecognisedWord::secs);
    let mut lengths: Vec<f64> = lengths.filter(|&secs| secs > 0.0).collect();
    lengths.sort_unstable_by(f64::total_cmp);
    let middle = |nth: usize| lengths.get(nth).copied().unwrap_or(0.0);
    let median = ((middle(lengths.len() / 2) + middle(lengths.len().saturating_sub(1) / 2)) / 2.0).min(MAX_MEDIAN_SECS);
    let max = 2.0 * median;
    let mut is_after_end = false;
    for word in segments.iter_mut().flat_map(|segment| &mut segment.words) {
        if is_after_end && word.secs() > max {
            word.start_secs = word.end_secs - max;
        }
        is_after_end = word.word.ends_with(SENTENCE_ENDS);
    }
    for RecognisedSegment { start_secs, end_secs, words, .. } in segments {
        let second = words.get(1).cloned();
        let Some(first) = words.first_mut() else { continue };
        let is_pair_long = second.as_ref().is_some_and(|second| second.end_secs - first.start_secs > 2.0 * max);
        if first.end_secs - last_secs > 4.0 * median && (first.secs() > max || is_pair_long) {
            let long_second = second.filter(|second| second.secs() > max);
            if let Some(second) = &long_second {
                first.end_secs = second.end_secs - max;
            }
            first.start_secs = (first.end_secs - max).max(0.0);
            let boundary = first.end_secs;
            if long_second.is_some() {
                words[1].start_secs = boundary;
            }
        }
        let first = &mut words[0];
        if *start_secs < first.end_secs && *start_secs - SEGMENT_SECS > first.start_secs {
            first.start_secs = (first.end_secs - median).min(*start_secs).max(0.0);
        } else {
            *start_secs = first.start_secs;
        }
        let Some(last) = words.last_mut() else { continue };
        if *end_secs > last.start_secs && *end_secs + SEGMENT_SECS < last.end_secs {
            last.end_secs = (last.start_secs + median).max(*end_secs);
        } else {
            *end_secs = last.end_secs;
        }
        last_secs = *end_secs;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tokenizer::tests::byte_tokenizer;

    fn words(text: &str, language: &str) -> Vec<(String, f64, f64)> {
        let tokenizer = byte_tokenizer();
        let tokens = tokenizer.encode(text);
        let times =
            TokenTimes { frames: (0..=tokens.len()).map(|n| 50 * n).collect(), probabilities: vec![0.5; tokens.len()] };
        let words = words_of(&tokenizer, language, &tokens, &times, 0);
        words.into_iter().map(|word| (word.word, word.start_secs, word.end_secs)).collect()
    }

    #[test]
    fn words_are_split_at_spaces_and_exclude_punctuation_from_their_times() {
        let expect = |words: &[(&str, f64, f64)]| {
            words.iter().map(|&(word, from, to)| (word.to_owned(), from, to)).collect::<Vec<_>>()
        };
        assert_eq!(
            words("(a) b-c' \u{2013} d?!", "en"),
            expect(&[("(a)", 1.0, 2.0), ("b-c'", 4.0, 7.0), ("d?!", 13.0, 14.0)])
        );
        // A character of three tokens; each is a word, and the stop belongs to the last.
        let expected = expect(&[("\u{65e5}", 0.0, 3.0), ("\u{672c}\u{3002}", 3.0, 6.0)]);
        assert_eq!(words("\u{65e5}\u{672c}\u{3002}", "ja"), expected);
        assert_eq!(words("\u{300c}\u{65e5}\u{672c}", "de"), expect(&[("\u{300c}\u{65e5}\u{672c}", 3.0, 9.0)]));
        assert!(words("... !", "en").is_empty());
    }

    #[test]
    fn words_that_contain_a_pause_are_shortened() {
        let word = |word: &str, start_secs, end_secs| RecognisedWord {
            word: word.to_owned(),
            start_secs,
            end_secs,
            probability: 1.0,
        };
        let first = vec![word("so", 0.0, 3.0), word("it", 3.0, 3.2), word("ends.", 3.2, 3.5)];
        let second = vec![word("Then", 3.5, 6.0), word("on", 6.0, 6.3), word("it", 6.3, 6.6), word("goes", 6.6, 9.0)];
        let segment =
            |start_secs, end_secs, words| RecognisedSegment { start_secs, end_secs, text: String::new(), words };
        let mut segments = [segment(2.6, 3.5, first), segment(3.5, 7.0, second), segment(7.0, 8.0, Vec::new())];
        shorten_long_words(&mut segments, 0.0);
        let words = segments.iter().flat_map(|segment| &segment.words);
        let times: Vec<_> = words.map(|word| (word.start_secs, word.end_secs)).collect();
        let expected = [(2.4, 3.0), (3.0, 3.2), (3.2, 3.5), (5.4, 6.0), (6.0, 6.3), (6.3, 6.6), (6.6, 7.0)];
        let is_near = |(a, b): (&(f64, f64), (f64, f64))| (a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9;
        assert!(times.iter().zip(expected).all(is_near), "{times:?}");
        assert!((segments[1].start_secs - 5.4).abs() < 1e-9 && segments[1].end_secs == 7.0);
    }
}
