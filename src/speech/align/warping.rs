//! Dynamic time warping of tokens to frames.

use ndarray::{Array2, ArrayView2};

/// Minimum length of a token, frames, if the sound is long enough for twice that.
const MIN_FRAMES: usize = 3;

/// Divides the frames between the tokens, in order, so that the total of `cost` [tokens, frames] is least: the first
/// frame of each token. Tokens are spread evenly if there are fewer frames.
pub(crate) fn first_frames(cost: ArrayView2<f32>) -> Vec<usize> {
    let (n_tokens, n_frames) = cost.dim();
    if n_frames < n_tokens || n_tokens == 0 {
        return (0..n_tokens).map(|token| token * n_frames / n_tokens).collect();
    }
    // Each token is a chain of states that each last a frame or longer.
    let n_states = (n_frames / (2 * n_tokens)).clamp(1, MIN_FRAMES);
    let mut totals = vec![f32::INFINITY; n_tokens * n_states];
    totals[0] = 0.0;
    let mut is_next = Array2::from_elem((n_frames, totals.len()), false);
    for (frame, costs) in cost.columns().into_iter().enumerate() {
        for state in (0..totals.len()).rev() {
            if frame > 0 && state > 0 && totals[state - 1] < totals[state] {
                totals[state] = totals[state - 1];
                is_next[(frame, state)] = true;
            }
            totals[state] += costs[state / n_states];
        }
    }
    let (mut first, mut state) = (vec![0; n_tokens], totals.len() - 1);
    for frame in (1..n_frames).rev() {
        // Costs that are no numbers leave the path; it must still reach the first state.
        if state > 0 && (is_next[(frame, state)] || state == frame) {
            if state % n_states == 0 {
                first[state / n_states] = frame;
            }
            state -= 1;
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    /// Least cost of the tokens from `token` on, each of at least `min` frames, in the frames from `from` on.
    fn least(cost: &Array2<f32>, token: usize, from: usize, min: usize) -> f32 {
        let sum = |until: usize| cost.row(token).iter().take(until).skip(from).sum::<f32>();
        let n_frames = cost.ncols();
        if token + 1 == cost.nrows() {
            return if from + min <= n_frames { sum(n_frames) } else { f32::INFINITY };
        }
        let totals = (from + min..n_frames).map(|until| sum(until) + least(cost, token + 1, until, min));
        totals.fold(f32::INFINITY, f32::min)
    }

    #[test]
    fn division_is_the_best_of_all_divisions() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for (n_tokens, n_frames, min) in [(1, 1, 1), (1, 6, 3), (3, 5, 1), (5, 5, 1), (4, 8, 1), (2, 9, 2), (3, 20, 3)]
        {
            for _ in 0..20 {
                let cost = Array2::from_shape_fn((n_tokens, n_frames), |_| rng.random::<f32>() - 0.5);
                let first = first_frames(cost.view());
                let until = |token: usize| first.get(token + 1).copied().unwrap_or(n_frames);
                let ranges = (0..n_tokens).map(|token| first[token]..until(token));
                assert!(first[0] == 0 && ranges.clone().all(|range| range.len() >= min), "{first:?}");
                let total: f32 =
                    ranges.enumerate().flat_map(|(token, range)| cost.row(token).to_vec()[range].to_vec()).sum();
                assert!((total - least(&cost, 0, 0, min)).abs() < 1e-4, "{total} {cost}");
            }
        }
    }

    #[test]
    fn any_costs_give_a_division() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0] {
            for (n_tokens, n_frames) in [(0, 0), (0, 3), (3, 0), (3, 7), (3, 30), (7, 3), (3, 3)] {
                let first = first_frames(Array2::from_elem((n_tokens, n_frames), value).view());
                assert!(first.len() == n_tokens && first.is_sorted() && first.iter().all(|&at| at <= n_frames));
                assert!(first.first().is_none_or(|&at| at == 0));
            }
        }
    }
}
