//! Phrases between the timestamps of a window.

use crate::align::token_times::FRAME_SECS;

/// Tokens between two timestamps, in seconds of the window.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TimedTokens {
    pub(super) start_secs: f64,
    pub(super) end_secs: f64,
    /// Including the timestamps.
    pub(super) tokens: Vec<u32>,
}

/// Phrases of a window.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct WindowText {
    pub(super) phrases: Vec<TimedTokens>,
    /// Start of the next window: text after the last pair of timestamps is left to it.
    pub(super) next_secs: f64,
    /// Whether a single timestamp is last: no speech follows it.
    pub(super) is_complete: bool,
}

/// Splits the tokens of a window of `window_secs` at its pairs of timestamps.
pub(super) fn split_at_timestamps(tokens: &[u32], timestamp_begin: u32, window_secs: f64) -> WindowText {
    let secs = |token: u32| token.checked_sub(timestamp_begin).map(|frames| f64::from(frames) * FRAME_SECS);
    let is_time = |nth: usize| tokens.get(nth).is_some_and(|&token| token >= timestamp_begin);
    let n = tokens.len();
    let mut ends: Vec<usize> = (1..n).filter(|&nth| is_time(nth - 1) && is_time(nth)).collect();
    let is_complete = n >= 2 && !is_time(n - 2) && is_time(n - 1);
    if ends.is_empty() {
        let last = tokens.iter().rev().find_map(|&token| secs(token)).filter(|&secs| secs > 0.0);
        let end_secs = last.unwrap_or(window_secs);
        let phrases = vec![TimedTokens { start_secs: 0.0, end_secs, tokens: tokens.to_vec() }];
        return WindowText { phrases, next_secs: window_secs, is_complete };
    }
    ends.extend(Some(n).filter(|_| is_complete));
    let phrase = |(from, &to): (usize, &usize)| {
        let [start_secs, end_secs] = [from, to - 1].map(|nth| secs(tokens[nth]).unwrap_or(0.0));
        TimedTokens { start_secs, end_secs, tokens: tokens[from..to].to_vec() }
    };
    let starts = [0].into_iter().chain(ends.iter().copied());
    let phrases: Vec<TimedTokens> = starts.zip(&ends).map(phrase).collect();
    let next_secs = phrases.last().filter(|_| !is_complete).map_or(window_secs, |last| last.end_secs);
    WindowText { phrases, next_secs, is_complete }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_split_at_pairs_of_timestamps() {
        let split = |tokens: &[u32]| split_at_timestamps(tokens, 1000, 30.0);
        let phrase =
            |start_secs, end_secs, tokens: &[u32]| TimedTokens { start_secs, end_secs, tokens: tokens.to_vec() };
        // The text after the last pair is left to the next window.
        let text = split(&[1000, 1, 1050, 1100, 2, 3, 1150, 1150, 4]);
        assert_eq!(text.phrases, [phrase(0.0, 1.0, &[1000, 1, 1050]), phrase(2.0, 3.0, &[1100, 2, 3, 1150])]);
        assert_eq!((text.next_secs, text.is_complete), (3.0, false));
        let text = split(&[1000, 1, 1050, 1100, 2, 1150]);
        assert_eq!(text.phrases[1], phrase(2.0, 3.0, &[1100, 2, 1150]));
        assert_eq!((text.next_secs, text.is_complete), (30.0, true));
        assert_eq!(split(&[1010, 1, 2, 1050]).phrases, [phrase(0.0, 1.0, &[1010, 1, 2, 1050])]);
        assert_eq!(split(&[1000, 1, 2]).phrases[0].end_secs, 30.0);
        for tokens in [&[][..], &[1000], &[1000, 1000], &[1, 1000, 1000, 1000]] {
            assert!(split(tokens).next_secs.is_finite());
        }
    }
}
