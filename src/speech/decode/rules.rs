//! Tokens that may follow the tokens decoded so far: symbols that are not spoken are suppressed, and timestamps come in
//! pairs and do not decrease.

use crate::tokenizer::Tokenizer;

/// Largest first timestamp, in steps of 20 ms.
const MAX_INITIAL_TIMESTAMP: usize = 50;
/// Logit in place of infinity.
const MAX_LOGIT: f32 = 1e30;

/// Suppressed tokens and the order of timestamps.
pub(crate) struct LogitRules {
    suppressed: Vec<usize>,
    eot: usize,
    timestamp_begin: usize,
}

impl LogitRules {
    /// `suppressed` are tokens of symbols that are not spoken; special tokens are suppressed, too.
    pub(crate) fn new(tokenizer: &Tokenizer, suppressed: &[u32]) -> Self {
        let special = tokenizer.eot() + 1..tokenizer.timestamp_begin();
        let suppressed = suppressed.iter().copied().filter(|&token| token < tokenizer.eot()).chain(special);
        Self {
            suppressed: suppressed.map(|token| token as usize).collect(),
            eot: tokenizer.eot() as usize,
            timestamp_begin: tokenizer.timestamp_begin() as usize,
        }
    }

    pub(crate) fn eot(&self) -> u32 {
        self.eot as u32
    }

    fn is_time(&self, token: u32) -> bool {
        token as usize >= self.timestamp_begin
    }

    /// Turns the logits of the token after `sampled`, the tokens of the window so far, into natural logarithms of
    /// probabilities; they are negative infinity for tokens that must not follow. At least one token is possible.
    pub(crate) fn log_probs(&self, logits: &mut [f32], sampled: &[u32]) {
        for logit in &mut *logits {
            *logit = if logit.is_nan() { f32::NEG_INFINITY } else { logit.min(MAX_LOGIT) };
        }
        for &token in &self.suppressed {
            forbid(logits, token, token + 1);
        }
        let begin = self.timestamp_begin.min(logits.len());
        let is_time = |nth_last: usize| sampled.iter().rev().nth(nth_last).map(|&token| self.is_time(token));
        match (is_time(0), is_time(1)) {
            (None, _) => {
                forbid(logits, 0, begin);
                forbid(logits, begin + MAX_INITIAL_TIMESTAMP + 1, usize::MAX);
            }
            (Some(true), Some(false)) => forbid(logits, 0, self.eot),
            (Some(true), _) => forbid(logits, begin, usize::MAX),
            (Some(false), _) => {}
        }
        if let Some(&latest) = sampled.iter().rev().find(|&&token| self.is_time(token)) {
            // The second timestamp of a pair may equal the first; segments have a length.
            let is_second = is_time(0) == Some(true) && is_time(1) == Some(false);
            forbid(logits, begin, latest as usize + usize::from(!is_second));
        }
        let max = |logits: &[f32]| logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let [max_text, max_time] = [max(&logits[..begin]), max(&logits[begin..])];
        let top = max_text.max(max_time);
        if top == f32::NEG_INFINITY {
            if let Some(end) = logits.get_mut(self.eot) {
                *end = 0.0;
            }
            return;
        }
        let sum = |logits: &[f32]| logits.iter().map(|&logit| f64::from((logit - top).exp())).sum::<f64>();
        let [text, time] = [sum(&logits[..begin]), sum(&logits[begin..])];
        // A timestamp follows if the timestamps together are more probable than any other token.
        let is_time = !sampled.is_empty() && time > f64::from((max_text - top).exp());
        if is_time {
            forbid(logits, 0, begin);
        }
        let norm = top + (if is_time { time } else { text + time }).ln() as f32;
        logits.iter_mut().for_each(|logit| *logit -= norm);
    }
}

fn forbid(logits: &mut [f32], from: usize, to: usize) {
    let to = to.min(logits.len());
    if from < to {
        logits[from..to].fill(f32::NEG_INFINITY);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tokenizer::tests::byte_tokenizer;

    /// Tokens that may follow `sampled` if the network prefers none.
    fn possible(sampled: &[u32]) -> Vec<u32> {
        let tokenizer = byte_tokenizer();
        let mut logits = vec![0.0; tokenizer.timestamp_begin() as usize + 1501];
        // The timestamps together are less probable than a text token.
        logits[tokenizer.timestamp_begin() as usize..].fill(-9.0);
        LogitRules::new(&tokenizer, &[40, 91]).log_probs(&mut logits, sampled);
        let sum: f32 = logits.iter().map(|logit| logit.exp()).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
        (0..logits.len() as u32).filter(|&token| logits[token as usize].is_finite()).collect()
    }

    #[test]
    fn timestamps_come_in_pairs_and_do_not_decrease() {
        let tokenizer = byte_tokenizer();
        let (at, eot, letter) = (|n: u32| tokenizer.timestamp_begin() + n, tokenizer.eot(), u32::from(b'a'));
        assert_eq!(possible(&[]), (at(0)..=at(50)).collect::<Vec<_>>());
        let is_text = |tokens: &[u32]| tokens.contains(&letter) && tokens.iter().all(|&token| token <= eot);
        assert!(is_text(&possible(&[at(3)])) && is_text(&possible(&[at(3), letter, at(9), at(9)])));
        let ends = possible(&[at(3), letter, at(9)]);
        assert_eq!(ends, [eot].into_iter().chain(at(9)..=at(1500)).collect::<Vec<_>>());
        let after_text = possible(&[at(3), letter]);
        assert!(after_text.contains(&letter) && !after_text.contains(&at(3)) && after_text.contains(&at(4)));
        let forbidden = [40, 91, tokenizer.sot(), tokenizer.no_timestamps(), tokenizer.no_speech()];
        assert!(forbidden.iter().all(|token| !after_text.contains(token)), "{after_text:?}");
    }

    #[test]
    fn likely_timestamps_exclude_text() {
        let tokenizer = byte_tokenizer();
        let begin = tokenizer.timestamp_begin() as usize;
        let mut logits = vec![0.0; begin + 1501];
        LogitRules::new(&tokenizer, &[40, 91]).log_probs(&mut logits, &[begin as u32, u32::from(b'a')]);
        assert!(logits[..begin].iter().all(|logit| !logit.is_finite()));
        assert!((logits[begin + 1] - (1.0f32 / 1500.0).ln()).abs() < 1e-4);
    }

    #[test]
    fn a_token_follows_any_logits() {
        let tokenizer = byte_tokenizer();
        let (rules, begin) = (LogitRules::new(&tokenizer, &[40, 91]), tokenizer.timestamp_begin());
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN] {
            for sampled in
                [vec![], vec![begin + 1500], vec![begin, 97], vec![begin, 97, begin + 1500], vec![u32::MAX, 97]]
            {
                for n in [0, 5, begin as usize, begin as usize + 1501] {
                    let mut logits = vec![value; n];
                    rules.log_probs(&mut logits, &sampled);
                    assert!(logits.iter().all(|logit| !logit.is_nan() && *logit <= 1e-6));
                    assert!(n < begin as usize || logits.iter().any(|logit| logit.is_finite()), "{value} {sampled:?}");
                }
            }
        }
    }
}
