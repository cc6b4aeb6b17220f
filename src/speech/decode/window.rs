//! One window: the prompt, and searches at rising temperatures until the text is neither repetitive nor improbable.

use super::rules::LogitRules;
use super::search::{Hypothesis, TokenModel, beam_search, sample};
use crate::tokenizer::Tokenizer;
use anyhow::Result;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use ndarray::Array2;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use std::io::Write as _;

/// Temperatures of the searches, in tenths.
const TENTHS: [u8; 6] = [0, 2, 4, 6, 8, 10];
/// Number of sequences that are drawn at a temperature above 0.
const N_DRAWN: usize = 5;
/// Ratio of bytes to compressed bytes of text that repeats itself.
const MAX_COMPRESSION: f32 = 2.4;
/// Mean logarithm of the probability of a token, below which the text is doubted.
pub(crate) const MIN_LOG_PROB: f32 = -1.0;
/// Probability of no speech, above which doubted text is silence.
pub(crate) const MAX_NO_SPEECH: f32 = 0.6;

/// Tokens of a window, with its timestamps, and what is known about their quality.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DecodedWindow {
    pub(crate) tokens: Vec<u32>,
    pub(crate) mean_log_prob: f32,
    pub(crate) no_speech: f32,
    /// Ratio of the bytes of the text to its compressed bytes.
    pub(crate) compression: f32,
    /// Temperature of the last search.
    pub(crate) temperature: f32,
}

impl DecodedWindow {
    pub(crate) fn is_repetitive(&self) -> bool {
        self.compression > MAX_COMPRESSION
    }

    fn is_improbable(&self) -> bool {
        self.mean_log_prob.is_nan() || self.mean_log_prob < MIN_LOG_PROB
    }

    pub(crate) fn is_silence(&self) -> bool {
        self.no_speech > MAX_NO_SPEECH && self.is_improbable()
    }
}

/// What the searches of all windows share.
pub(crate) struct WindowDecoder<'a> {
    pub(crate) tokenizer: &'a Tokenizer,
    pub(crate) rules: &'a LogitRules,
    /// Tokens from the start of the transcript on, which request the language and the task.
    pub(crate) request: &'a [u32],
    /// Maximum number of tokens that the network reads.
    pub(crate) max_tokens: usize,
    /// Number of sequences of the beam search; 1 is greedy.
    pub(crate) beam: usize,
}

impl WindowDecoder<'_> {
    /// Decodes a window after the tokens `previous`, of which the last that fit are the prompt. `start` returns the
    /// network with the encoded window and no tokens. `seed` determines the tokens that are drawn.
    pub(crate) fn decode<M: TokenModel>(
        &self,
        mut start: impl FnMut() -> M,
        previous: &[u32],
        seed: u64,
    ) -> Result<DecodedWindow> {
        let n_prompt = previous.len().min((self.max_tokens / 2).saturating_sub(1));
        let mut prompt: Vec<u32> = previous[previous.len() - n_prompt..].to_vec();
        if !prompt.is_empty() {
            prompt.insert(0, self.tokenizer.start_of_previous());
        }
        let (sot, request) = self.request.split_at(self.request.len().min(1));
        prompt.extend(sot);
        let max_new = (self.max_tokens / 2).min(self.max_tokens.saturating_sub(prompt.len() + request.len()));
        let mut rejected: Vec<DecodedWindow> = Vec::new();
        for tenths in TENTHS {
            let temperature = f32::from(tenths) / 10.0;
            let mut model = start();
            let first = model.step(&[prompt.clone()])?;
            let no_speech = probability(&first, self.tokenizer.no_speech());
            let logits = if request.is_empty() { first } else { model.step(&[request.to_vec()])? };
            let mut rng = ChaCha8Rng::seed_from_u64(seed ^ u64::from(tenths) << 56);
            let hypothesis = match tenths {
                0 if self.beam > 1 => beam_search(&mut model, logits, self.rules, self.beam, max_new)?,
                0 => sample(&mut model, logits, self.rules, (1, 0.0), max_new, &mut rng)?,
                _ => sample(&mut model, logits, self.rules, (N_DRAWN, temperature), max_new, &mut rng)?,
            };
            let Hypothesis { tokens, sum_log_prob } = hypothesis;
            let compression = compression(self.tokenizer.decode(&tokens).trim());
            let mean_log_prob = sum_log_prob / (tokens.len() + 1) as f32;
            let decoded = DecodedWindow { tokens, mean_log_prob, no_speech, compression, temperature };
            if decoded.is_silence() || !decoded.is_repetitive() && !decoded.is_improbable() {
                return Ok(decoded);
            }
            rejected.push(decoded);
        }
        // The most probable of those that are not repetitive, if there are any.
        let rank = |window: &DecodedWindow| (window.is_repetitive(), -window.mean_log_prob);
        let last = rejected.last().map_or(0.0, |window| window.temperature);
        let chosen = rejected.into_iter().reduce(|best, other| if rank(&other) < rank(&best) { other } else { best });
        let empty = || DecodedWindow {
            tokens: vec![],
            mean_log_prob: 0.0,
            no_speech: 1.0,
            compression: 0.0,
            temperature: last,
        };
        Ok(DecodedWindow { temperature: last, ..chosen.unwrap_or_else(empty) })
    }
}

fn probability(logits: &Array2<f32>, token: u32) -> f32 {
    let Some(&logit) = logits.get((0, token as usize)) else { return 0.0 };
    1.0 / logits.row(0).iter().map(|other| (other - logit).exp()).sum::<f32>()
}

/// Ratio of the bytes of a text to its bytes after compression; large if it repeats itself.
fn compression(text: &str) -> f32 {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    let compressed = encoder.write_all(text.as_bytes()).and_then(|()| encoder.finish());
    text.len() as f32 / compressed.map_or(1, |bytes| bytes.len().max(1)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::search::tests::Scripted;
    use crate::tokenizer::tests::byte_tokenizer;
    use std::cell::RefCell;

    /// Decodes with networks that write these texts, one for each search, with a logit for no speech.
    fn decode(texts: &[&str], no_speech: f32, previous: &[u32]) -> (DecodedWindow, Vec<Vec<u32>>) {
        let (tokenizer, prompts) = (byte_tokenizer(), RefCell::new(Vec::new()));
        let rules = LogitRules::new(&tokenizer, &[]);
        let request = [tokenizer.sot(), tokenizer.transcribe()];
        let decoder =
            WindowDecoder { tokenizer: &tokenizer, rules: &rules, request: &request, max_tokens: 448, beam: 2 };
        let begin = tokenizer.timestamp_begin();
        let mut nth = 0;
        let start = || {
            let text: Vec<u32> = [begin].into_iter().chain(tokenizer.encode(texts[nth.min(texts.len() - 1)])).collect();
            nth += 1;
            let (prompts, no_speech_token, eot) = (&prompts, tokenizer.no_speech() as usize, tokenizer.eot());
            Scripted::new(move |tokens: &[u32]| {
                let mut logits = vec![0.0; begin as usize + 1501];
                let Some(at) = tokens.iter().position(|&token| token == begin) else {
                    logits[begin as usize] = 20.0;
                    logits[no_speech_token] = no_speech;
                    prompts.borrow_mut().push(tokens.to_vec());
                    return logits;
                };
                let next = text.get(tokens.len() - at).copied().unwrap_or(eot);
                // Text with a question mark is improbable.
                logits[next as usize] = if text.contains(&63) { 4.0 } else { 20.0 };
                logits
            })
        };
        let decoded = decoder.decode(start, previous, 7).unwrap();
        (decoded, prompts.into_inner())
    }

    #[test]
    fn doubted_text_is_decoded_at_higher_temperatures() {
        let begin = byte_tokenizer().timestamp_begin();
        let (decoded, _) = decode(&[" good words"], 0.0, &[]);
        assert_eq!((decoded.temperature, &decoded.tokens[..3]), (0.0, &[begin, 32, 103][..]));
        assert!(decoded.mean_log_prob > -0.1 && decoded.no_speech < 0.1, "{decoded:?}");
        let loops = "very ".repeat(60);
        let (decoded, _) = decode(&[&loops, " good words"], 0.0, &[]);
        assert!(decoded.temperature == 0.2 && !decoded.is_repetitive(), "{decoded:?}");
        let (decoded, _) = decode(&[&loops], 0.0, &[]);
        assert!(decoded.is_repetitive() && decoded.temperature == 1.0, "{decoded:?}");
        // Improbable text is silence if no speech is probable.
        let (decoded, _) = decode(&[" you?"], 30.0, &[]);
        assert!(decoded.is_silence() && decoded.temperature == 0.0, "{decoded:?}");
    }

    #[test]
    fn previous_text_is_the_prompt() {
        let tokenizer = byte_tokenizer();
        let previous: Vec<u32> = (0..500).map(|n| n % 250).collect();
        let (_, prompts) = decode(&[" a"], 0.0, &previous);
        assert_eq!(prompts[0].len(), 225);
        assert_eq!(
            (prompts[0][0], prompts[0][223], prompts[0][224]),
            (tokenizer.start_of_previous(), 249, tokenizer.sot())
        );
        assert_eq!(prompts[1][225..], [tokenizer.transcribe()]);
    }
}
