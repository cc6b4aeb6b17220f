//! Times of tokens from the attention of the alignment heads: softmax over the frames of the window, median filter, mean
//! of the heads, dynamic time warping. OpenAI's program also standardises the attention over the tokens, which makes 95 %
//! of the boundaries of synthetic speech uncertain by 150 ms instead of 123 ms (tiny.en, after removal of the delay).

use super::warping::first_frames;
use crate::network::TokenAttention;
use ndarray::{Array2, ArrayView2, s};

/// Seconds of an encoded frame.
pub(crate) const FRAME_SECS: f64 = 0.02;
/// Width of the median filter, frames.
const MEDIAN_WIDTH: usize = 7;

/// Times and probabilities of the text tokens of a window.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TokenTimes {
    /// First frame of each token, and of the end after the last one.
    pub(crate) frames: Vec<usize>,
    /// Probability of each token after those before it.
    pub(crate) probabilities: Vec<f32>,
}

impl TokenTimes {
    /// From the attention to a window of `n_frames` encoded frames, of `n_prompt` tokens, `text`, and the end token.
    pub(crate) fn new(attention: &TokenAttention, n_prompt: usize, text: &[u32], n_frames: usize, eot: u32) -> Self {
        let (n_heads, n_tokens, n_attended) = attention.weights.dim();
        let n_frames = n_frames.clamp(1, n_attended.max(1)).min(n_attended);
        // The row of a token predicts the next one: the rows from the last of the prompt on predict the text and the
        // end.
        let rows = n_prompt.saturating_sub(1)..(n_prompt + text.len()).min(n_tokens);
        let mut fit = Array2::<f32>::zeros((rows.len(), n_frames));
        for head in attention.weights.outer_iter() {
            for (mut fit, row) in fit.outer_iter_mut().zip(head.slice(s![rows.clone(), ..n_frames]).outer_iter()) {
                let top = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                let weights: Vec<f32> = row.iter().map(|score| (score - top).exp()).collect();
                let scale = weights.iter().sum::<f32>() * n_heads as f32;
                fit.iter_mut().zip(median_filter(&weights)).for_each(|(fit, weight)| *fit += weight / scale);
            }
        }
        let frames = first_frames(fit.mapv(|fit| -fit).view());
        let logits = attention.logits.view();
        let first_row = n_prompt.saturating_sub(1);
        let probabilities = text.iter().enumerate();
        let probabilities =
            probabilities.map(|(nth, &token)| probability(logits, first_row + nth, token, eot)).collect();
        Self { frames, probabilities }
    }

    /// First frame of a token, or of the end.
    pub(crate) fn start(&self, token: usize) -> usize {
        self.frames.get(token).or(self.frames.last()).copied().unwrap_or(0)
    }

    /// Mean probability of tokens.
    pub(crate) fn mean_probability(&self, tokens: impl Iterator<Item = usize>) -> f32 {
        let known: Vec<f32> = tokens.filter_map(|token| self.probabilities.get(token).copied()).collect();
        known.iter().sum::<f32>() / known.len().max(1) as f32
    }
}

/// Probability of a text token among all text tokens.
fn probability(logits: ArrayView2<f32>, row: usize, token: u32, eot: u32) -> f32 {
    let Some(&logit) = logits.get((row, token as usize)) else { return 0.0 };
    let n_text = (eot as usize).min(logits.ncols());
    let probability = 1.0 / logits.slice(s![row, ..n_text]).iter().map(|other| (other - logit).exp()).sum::<f32>();
    if probability.is_finite() { probability.min(1.0) } else { 0.0 }
}

/// Median of each value and its neighbours; at the ends, the values are reflected.
fn median_filter(values: &[f32]) -> Vec<f32> {
    let (n, reach) = (values.len(), MEDIAN_WIDTH / 2);
    if n <= reach {
        return values.to_vec();
    }
    let reflected = |at: isize| {
        let at = at.unsigned_abs();
        values[if at < n { at } else { 2 * (n - 1) - at }]
    };
    let median = |at: usize| {
        let at = at as isize;
        let mut around: [f32; MEDIAN_WIDTH] = std::array::from_fn(|nth| reflected(at + nth as isize - reach as isize));
        around.sort_unstable_by(f32::total_cmp);
        around[reach]
    };
    (0..n).map(median).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array3;

    #[test]
    fn median_filter_reflects_the_ends() {
        assert_eq!(median_filter(&[1.0, 9.0]), [1.0, 9.0]);
        assert_eq!(median_filter(&[0.0, 1.0, 2.0, 3.0, 9.0]), [2.0; 5]);
        let mut spike = [0.0; 20];
        spike[9] = 5.0;
        assert_eq!(median_filter(&spike), [0.0; 20]);
    }

    #[test]
    fn tokens_start_where_their_attention_starts() {
        // Two prompt tokens, three text tokens and the end; the rows from the second on attend to ranges of frames.
        let starts = [0, 10, 40, 60];
        let weights = Array3::from_shape_fn((2, 6, 1500), |(_, row, frame)| {
            let from = |row: usize| starts.get(row).copied().unwrap_or(100);
            let is_attended = row > 0 && (from(row - 1)..from(row)).contains(&frame);
            if is_attended { 4.0 } else { 0.0 }
        });
        let logits = Array2::from_shape_fn((6, 300), |(row, token)| if token == row + 40 { 3.0 } else { 0.0 });
        let attention = TokenAttention { weights, logits };
        let times = TokenTimes::new(&attention, 2, &[41, 42, 250], 100, 259);
        assert_eq!(times.frames.len(), 4);
        assert!(
            times.frames.iter().zip(starts).all(|(&frame, start)| frame.abs_diff(start) <= 1),
            "{:?}",
            times.frames
        );
        let likely = 3f32.exp() / (258.0 + 3f32.exp());
        assert!((times.probabilities[0] - likely).abs() < 1e-5 && times.probabilities[2] < 0.01);
        assert!((times.mean_probability(0..2) - likely).abs() < 1e-5);
    }

    #[test]
    fn any_attention_gives_times() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0] {
            for n_frames in [0, 1, 5, 3000] {
                let attention = TokenAttention {
                    weights: Array3::from_elem((2, 5, 1500), value),
                    logits: Array2::from_elem((5, 300), value),
                };
                let times = TokenTimes::new(&attention, 2, &[1, 2], n_frames, 259);
                assert!(times.frames.len() == 3 && times.frames.is_sorted());
                assert!(times.probabilities.iter().all(|probability| (0.0..=1.0).contains(probability)));
            }
        }
    }
}
