//! Greedy search, sampling and beam search over the tokens of a window.

use super::rules::LogitRules;
use crate::network::TokenDecoder;
use anyhow::Result;
use ndarray::Array2;
use rand::Rng as _;
use rand_chacha::ChaCha8Rng;

/// A network that predicts the next token of several sequences about the same sound.
pub(crate) trait TokenModel {
    /// Appends tokens, equally many to each sequence; returns logits [sequences, vocabulary] of the next token.
    fn step(&mut self, tokens: &[Vec<u32>]) -> Result<Array2<f32>>;
    /// Continues with these sequences.
    fn reorder(&mut self, from: &[usize]) -> Result<()>;
}

impl TokenModel for TokenDecoder<'_> {
    fn step(&mut self, tokens: &[Vec<u32>]) -> Result<Array2<f32>> {
        TokenDecoder::step(self, tokens)
    }

    fn reorder(&mut self, from: &[usize]) -> Result<()> {
        TokenDecoder::reorder(self, from)
    }
}

/// A sequence of tokens without its end token, and the sum of the logarithms of their probabilities.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Hypothesis {
    pub(crate) tokens: Vec<u32>,
    pub(crate) sum_log_prob: f32,
}

impl Hypothesis {
    fn with(&self, token: u32, eot: u32, sum_log_prob: f32) -> Self {
        let end = Some(token).filter(|&token| token != eot);
        Self { tokens: self.tokens.iter().copied().chain(end).collect(), sum_log_prob }
    }

    /// Score that does not prefer short sequences.
    fn score(&self) -> f32 {
        self.sum_log_prob / self.tokens.len().max(1) as f32
    }
}

/// The best of several hypotheses, of equals the first.
fn best(hypotheses: Vec<Hypothesis>) -> Hypothesis {
    let mut hypotheses = hypotheses.into_iter();
    let first = hypotheses.next().unwrap_or_default();
    hypotheses.fold(first, |best, other| if other.score() > best.score() { other } else { best })
}

/// Beam search from the logits of the first token: of the `2 * beam` best continuations, those that end are completed
/// hypotheses and the others fill the beam. It ends with `beam` completed hypotheses or after `max_tokens`.
pub(crate) fn beam_search(
    model: &mut impl TokenModel,
    mut logits: Array2<f32>,
    rules: &LogitRules,
    beam: usize,
    max_tokens: usize,
) -> Result<Hypothesis> {
    let (mut alive, mut completed) = (vec![Hypothesis::default()], Vec::new());
    for nth in 0..max_tokens {
        let mut candidates: Vec<(f32, usize, u32)> = Vec::new();
        for (from, (row, hypothesis)) in logits.outer_iter().zip(&alive).enumerate() {
            let mut row = row.to_vec();
            rules.log_probs(&mut row, &hypothesis.tokens);
            let top = top(&row, 2 * beam);
            candidates
                .extend(top.into_iter().map(|(log_prob, token)| (hypothesis.sum_log_prob + log_prob, from, token)));
        }
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
        candidates.truncate(2 * beam);
        let (leading, others) = candidates.split_at(beam.min(candidates.len()));
        let mut others = others.iter().filter(|&&(_, _, token)| token != rules.eot());
        let mut next = Vec::new();
        for candidate @ &(sum_log_prob, from, token) in leading {
            if token == rules.eot() || nth + 1 == max_tokens {
                completed.push(alive[from].with(token, rules.eot(), sum_log_prob));
                next.extend(others.next());
            } else {
                next.push(candidate);
            }
        }
        if completed.len() >= beam || next.is_empty() || nth + 1 == max_tokens {
            break;
        }
        alive = next.iter().map(|&&(sum, from, token)| alive[from].with(token, rules.eot(), sum)).collect();
        let from: Vec<usize> = next.iter().map(|&&(_, from, _)| from).collect();
        model.reorder(&from)?;
        logits = model.step(&next.iter().map(|&&(_, _, token)| vec![token]).collect::<Vec<_>>())?;
    }
    Ok(best(completed))
}

/// The best of `n` sequences whose tokens are drawn at a temperature; at 0, the most probable tokens are taken.
pub(crate) fn sample(
    model: &mut impl TokenModel,
    mut logits: Array2<f32>,
    rules: &LogitRules,
    (n, temperature): (usize, f32),
    max_tokens: usize,
    rng: &mut ChaCha8Rng,
) -> Result<Hypothesis> {
    let (mut alive, mut completed) = (vec![Hypothesis::default(); n], Vec::new());
    for nth in 0..max_tokens {
        let (mut from, mut tokens, mut next) = (Vec::new(), Vec::new(), Vec::new());
        for (at, hypothesis) in alive.iter().enumerate() {
            // The first logits are those of all sequences.
            let row_number = at.min(logits.nrows().saturating_sub(1));
            let mut row = logits.row(row_number).to_vec();
            rules.log_probs(&mut row, &hypothesis.tokens);
            let (log_prob, token) = draw(&row, temperature, rng).unwrap_or((f32::NEG_INFINITY, rules.eot()));
            let hypothesis = hypothesis.with(token, rules.eot(), hypothesis.sum_log_prob + log_prob);
            if token == rules.eot() || nth + 1 == max_tokens {
                completed.push(hypothesis);
            } else {
                from.push(row_number);
                tokens.push(vec![token]);
                next.push(hypothesis);
            }
        }
        if next.is_empty() {
            break;
        }
        alive = next;
        model.reorder(&from)?;
        logits = model.step(&tokens)?;
    }
    Ok(best(completed))
}

/// The `n` most probable tokens in descending order, of equals the first.
fn top(log_probs: &[f32], n: usize) -> Vec<(f32, u32)> {
    let mut top: Vec<(f32, u32)> = Vec::with_capacity(n + 1);
    for (token, &log_prob) in log_probs.iter().enumerate().filter(|(_, log_prob)| log_prob.is_finite()) {
        if top.len() < n || top.last().is_some_and(|&(least, _)| log_prob > least) {
            let at = top.partition_point(|&(other, _)| other >= log_prob);
            top.insert(at, (log_prob, token as u32));
            top.truncate(n);
        }
    }
    top
}

fn draw(log_probs: &[f32], temperature: f32, rng: &mut ChaCha8Rng) -> Option<(f32, u32)> {
    let most = top(log_probs, 1).pop()?;
    if temperature <= 0.0 {
        return Some(most);
    }
    let weight = |log_prob: f32| f64::from((log_prob - most.0) / temperature).exp();
    let total: f64 = log_probs.iter().map(|&log_prob| weight(log_prob)).sum();
    let mut rest = rng.random::<f64>() * total;
    let drawn = log_probs.iter().position(|&log_prob| {
        rest -= weight(log_prob);
        rest < 0.0
    });
    Some(drawn.map_or(most, |token| (log_probs[token], token as u32)))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::tokenizer::tests::byte_tokenizer;
    use rand::SeedableRng as _;

    /// Network whose logits are a function of all tokens of a sequence.
    pub(crate) struct Scripted<F> {
        sequences: Vec<Vec<u32>>,
        logits: F,
    }

    impl<F: Fn(&[u32]) -> Vec<f32>> Scripted<F> {
        pub(crate) fn new(logits: F) -> Self {
            Self { sequences: vec![Vec::new()], logits }
        }
    }

    impl<F: Fn(&[u32]) -> Vec<f32>> TokenModel for Scripted<F> {
        fn step(&mut self, tokens: &[Vec<u32>]) -> Result<Array2<f32>> {
            assert_eq!(tokens.len(), self.sequences.len());
            self.sequences.iter_mut().zip(tokens).for_each(|(sequence, tokens)| sequence.extend(tokens));
            let rows: Vec<Vec<f32>> = self.sequences.iter().map(|sequence| (self.logits)(sequence)).collect();
            Ok(Array2::from_shape_vec((rows.len(), rows[0].len()), rows.concat())?)
        }

        fn reorder(&mut self, from: &[usize]) -> Result<()> {
            self.sequences = from.iter().map(|&from| self.sequences[from].clone()).collect();
            Ok(())
        }
    }

    /// Network of a vocabulary of bytes in which `next` gives the probabilities of few tokens after a text.
    fn network(next: impl Fn(&str) -> Vec<(char, f32)>) -> (LogitRules, Scripted<impl Fn(&[u32]) -> Vec<f32>>) {
        let tokenizer = byte_tokenizer();
        let rules = LogitRules::new(&tokenizer, &[]);
        let model = Scripted::new(move |tokens: &[u32]| {
            let mut logits = vec![f32::NEG_INFINITY; tokenizer.timestamp_begin() as usize + 1501];
            if tokens.len() == 1 {
                logits[tokenizer.timestamp_begin() as usize] = 0.0;
            } else {
                for (letter, probability) in next(&tokenizer.decode(tokens)) {
                    let token = if letter == '.' { tokenizer.eot() as usize } else { letter as usize };
                    logits[token] = probability.ln();
                }
            }
            logits
        });
        (rules, model)
    }

    fn first(model: &mut impl TokenModel) -> Array2<f32> {
        model.step(&[vec![byte_tokenizer().sot()]]).unwrap()
    }

    #[test]
    fn beam_search_finds_what_the_greedy_search_misses() {
        let next = |text: &str| match text {
            "" => vec![('a', 0.6), ('b', 0.4)],
            "b" => vec![('c', 0.9), ('d', 0.1)],
            "bc" => vec![('.', 1.0)],
            _ => vec![('x', 0.3), ('y', 0.3), ('.', 0.4)],
        };
        let (rules, mut model) = network(next);
        let logits = first(&mut model);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let greedy = sample(&mut model, logits, &rules, (1, 0.0), 20, &mut rng).unwrap();
        let text = |hypothesis: &Hypothesis| byte_tokenizer().decode(&hypothesis.tokens);
        assert_eq!(text(&greedy), "a");
        assert!((greedy.sum_log_prob - (0.6f32 * 0.4).ln()).abs() < 1e-5);
        let (rules, mut model) = network(next);
        let logits = first(&mut model);
        let found = beam_search(&mut model, logits, &rules, 3, 20).unwrap();
        assert_eq!(text(&found), "bc");
        assert!((found.sum_log_prob - (0.4f32 * 0.9).ln()).abs() < 1e-5);
    }

    #[test]
    fn drawn_tokens_depend_on_the_seed_alone() {
        let next = |text: &str| match text.len() {
            40 => vec![('.', 1.0)],
            _ => vec![('a', 0.5), ('b', 0.3), ('c', 0.2)],
        };
        let draw = |seed, temperature| {
            let (rules, mut model) = network(next);
            let logits = first(&mut model);
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            sample(&mut model, logits, &rules, (1, temperature), 60, &mut rng).unwrap()
        };
        assert_eq!(draw(1, 1.0), draw(1, 1.0));
        assert_ne!(draw(1, 1.0), draw(2, 1.0));
        let letters = |hypothesis: &Hypothesis| hypothesis.tokens.iter().filter(|&&token| token == 97).count();
        assert_eq!(letters(&draw(3, 0.0)), 40);
        assert!((10..32).contains(&letters(&draw(3, 1.0))) && letters(&draw(3, 0.1)) > 36);
    }

    #[test]
    fn searches_end_on_any_logits() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0] {
            let model = || Scripted::new(|_: &[u32]| vec![value; byte_tokenizer().timestamp_begin() as usize + 1501]);
            let rules = LogitRules::new(&byte_tokenizer(), &[]);
            let mut searched = model();
            let logits = first(&mut searched);
            let found = beam_search(&mut searched, logits, &rules, 5, 30).unwrap();
            assert!(found.tokens.len() <= 30);
            let (mut searched, mut rng) = (model(), ChaCha8Rng::seed_from_u64(1));
            let logits = first(&mut searched);
            let found = sample(&mut searched, logits, &rules, (5, 1.0), 30, &mut rng).unwrap();
            assert!(found.tokens.len() <= 30);
        }
    }
}
