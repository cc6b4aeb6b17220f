//! Dynamic time warping of tokens to frames.

use ndarray::{Array2, ArrayView2};

/// The path of the least total cost from the first token and frame to the last ones, in steps of one token, one frame
/// or both, through `cost` [tokens, frames]: the first frame of each token. Of equal paths, the later tokens are longer.
pub(crate) fn first_frames(cost: ArrayView2<f32>) -> Vec<usize> {
    let (n_tokens, n_frames) = cost.dim();
    if n_tokens == 0 || n_frames == 0 {
        return vec![0; n_tokens];
    }
    // Totals up to each frame, of the token before and of this one; the first column precedes all frames.
    let mut before = vec![f32::INFINITY; n_frames + 1];
    before[0] = 0.0;
    let mut totals = before.clone();
    let mut steps = Array2::from_elem((n_tokens, n_frames), Step::Frame);
    for (token, costs) in cost.outer_iter().enumerate() {
        totals[0] = f32::INFINITY;
        for (frame, &cost) in costs.iter().enumerate() {
            let [both, next_token, next_frame] = [before[frame], before[frame + 1], totals[frame]];
            let (least, step) = if both < next_token && both < next_frame {
                (both, Step::Both)
            } else if next_token < both && next_token < next_frame {
                (next_token, Step::Token)
            } else {
                (next_frame, Step::Frame)
            };
            totals[frame + 1] = least + cost;
            steps[(token, frame)] = step;
        }
        std::mem::swap(&mut before, &mut totals);
    }
    let mut first = vec![0; n_tokens];
    let (mut token, mut frame) = (n_tokens - 1, n_frames - 1);
    loop {
        first[token] = frame;
        match steps[(token, frame)] {
            _ if token == 0 => break,
            Step::Both if frame > 0 => (token, frame) = (token - 1, frame - 1),
            Step::Frame if frame > 0 => frame -= 1,
            _ => token -= 1,
        }
    }
    first[0] = 0;
    first
}

/// Last step of the best path to a token and frame.
#[derive(Clone, Copy)]
enum Step {
    Token,
    Frame,
    Both,
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    /// Least cost of all paths from a cell to the last one.
    fn least(cost: &Array2<f32>, token: usize, frame: usize) -> f32 {
        let Some(&here) = cost.get((token, frame)) else { return f32::INFINITY };
        if (token + 1, frame + 1) == cost.dim() {
            return here;
        }
        let onward = [(1, 0), (0, 1), (1, 1)].map(|(tokens, frames)| least(cost, token + tokens, frame + frames));
        here + onward.into_iter().fold(f32::INFINITY, f32::min)
    }

    #[test]
    fn path_is_the_best_of_all_paths() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for (n_tokens, n_frames) in [(1, 1), (1, 6), (4, 1), (3, 5), (5, 5), (6, 3), (4, 8)] {
            for _ in 0..20 {
                let cost = Array2::from_shape_fn((n_tokens, n_frames), |_| rng.random::<f32>() - 0.5);
                let first = first_frames(cost.view());
                assert!(first.is_sorted() && first[0] == 0 && first[n_tokens - 1] < n_frames);
                // The cheapest path whose tokens start in these frames ends each token in the next one's first frame
                // or before it.
                let mut total = 0.0;
                for token in 0..n_tokens {
                    let until = first.get(token + 1).copied().unwrap_or(n_frames - 1);
                    let sum = |until: usize| (first[token]..=until).map(|frame| cost[(token, frame)]).sum::<f32>();
                    let is_last = token + 1 == n_tokens;
                    let short = if is_last || until == first[token] { f32::INFINITY } else { sum(until - 1) };
                    total += sum(until).min(short);
                }
                assert!((total - least(&cost, 0, 0)).abs() < 1e-4, "{total} {cost}");
            }
        }
    }

    #[test]
    fn any_costs_give_a_path() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0] {
            for (n_tokens, n_frames) in [(0, 0), (0, 3), (3, 0), (3, 7), (7, 3)] {
                let first = first_frames(Array2::from_elem((n_tokens, n_frames), value).view());
                assert!(first.len() == n_tokens && first.is_sorted() && first.iter().all(|&at| at <= n_frames));
            }
        }
    }
}
