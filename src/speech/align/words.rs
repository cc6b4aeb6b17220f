//! Words of tokens and their times.

use super::token_times::{FRAME_SECS, TokenTimes};
use crate::recognised::RecognisedWord;
use crate::tokenizer::Tokenizer;

/// Languages that are written without spaces between words; each character is a word.
pub(crate) const WITHOUT_SPACES: [&str; 6] = ["zh", "ja", "th", "lo", "my", "yue"];
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
}
