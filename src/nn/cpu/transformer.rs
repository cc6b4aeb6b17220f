//! Row-wise operations of transformers, compiled for AVX-512, for AVX2 and for any processor: layer norm, GELU,
//! softmax, and attention of one position over the keys and values of several heads. Row lengths are multiples of
//! [`COLUMNS`].

use super::packed_matrix::COLUMNS;
use super::tensor::Scalar;
use super::vectorised::{add_scaled, inner_product, vectorised};

/// Added to variances before their square root, as in PyTorch.
const EPS: f64 = 1e-5;
/// Smaller softmax weights and tails of GELU become 0: arithmetic with denormal numbers is a hundred times slower.
const SMALLEST: f64 = 1e-25;

vectorised!(
    /// Normalises each row of `rows` to mean 0 and variance 1, then scales it by `gamma` and adds `beta`, which have
    /// the length of a row.
    layer_norm = layer_norm_body(rows: &[T], gamma: &[T], beta: &[T], to: &mut [T])
);

#[inline(always)]
fn layer_norm_body<T: Scalar>(rows: &[T], gamma: &[T], beta: &[T], to: &mut [T]) {
    let (width, n) = (gamma.len(), T::from_f64(gamma.len() as f64));
    for (row, to) in rows.chunks_exact(width).zip(to.chunks_exact_mut(width)) {
        let mean = lane_sum(row, |v| v) / n;
        let variance = lane_sum(row, |v| (v - mean) * (v - mean)) / n;
        let scale = T::from_f64(1.0 / (variance.to_f64() + EPS).sqrt());
        for (((to, value), gamma), beta) in to.iter_mut().zip(row).zip(gamma).zip(beta) {
            *to = (*value - mean) * scale * *gamma + *beta;
        }
    }
}

#[inline(always)]
fn lane_sum<T: Scalar>(row: &[T], term: impl Fn(T) -> T) -> T {
    let mut lanes = [T::zero(); COLUMNS];
    for values in row.as_chunks::<COLUMNS>().0 {
        for i in 0..COLUMNS {
            lanes[i] += term(values[i]);
        }
    }
    lanes.iter().fold(T::zero(), |sum, lane| sum + *lane)
}

vectorised!(
    /// Applies x Phi(x), with Phi the standard normal distribution, to an absolute error of 1e-7 |x|.
    gelu = gelu_body(values: &mut [T])
);

/// Abramowitz and Stegun, formula 7.1.26.
#[inline(always)]
fn gelu_body<T: Scalar>(values: &mut [T]) {
    let number = T::from_f64;
    let (zero, one, half) = (T::zero(), T::one(), number(0.5));
    for value in values {
        let x = *value;
        let magnitude = if x < zero { zero - x } else { x };
        let t = one / (one + number(0.327_591_1 * std::f64::consts::FRAC_1_SQRT_2) * magnitude);
        let series = ((((number(1.061_405_429) * t - number(1.453_152_027)) * t + number(1.421_413_741)) * t
            - number(0.284_496_736))
            * t
            + number(0.254_829_592))
            * t;
        let tail = half * series * (zero - half * x * x).fast_exp();
        let tail = if tail < number(SMALLEST) { zero } else { tail };
        *value = x * if x < zero { tail } else { one - tail };
    }
}

vectorised!(
    /// Softmax of the first `n` values of each row of length `width`; the other values of the row are overwritten.
    softmax = softmax_body(rows: &mut [T], width: usize, n: usize)
);

#[inline(always)]
fn softmax_body<T: Scalar>(rows: &mut [T], width: usize, n: usize) {
    for row in rows.chunks_exact_mut(width) {
        row[n..].fill(T::from_f64(-1e30));
        let mut lanes = [row[0]; COLUMNS];
        for values in row.as_chunks::<COLUMNS>().0 {
            for i in 0..COLUMNS {
                lanes[i] = if values[i] > lanes[i] { values[i] } else { lanes[i] };
            }
        }
        let max = lanes.iter().fold(row[0], |max, lane| if *lane > max { *lane } else { max });
        row.iter_mut().for_each(|value| *value = (*value - max).fast_exp());
        let scale = T::one() / lane_sum(row, |v| v);
        for value in row {
            *value = if *value < T::from_f64(SMALLEST) { T::zero() } else { *value * scale };
        }
    }
}

vectorised!(
    /// Attention of one position over the rows of `keys` and `values`, whose columns are divided into `n_heads` heads:
    /// context = values, weighted with the softmax of the inner products of query and keys. `scores` is a buffer with
    /// at least as many values as there are keys, rounded up to a multiple of [`COLUMNS`].
    attend_heads = attend_heads_body(query: &[T], keys: &[T], values: &[T], n_heads: usize, scores: &mut [T],
        context: &mut [T])
);

#[inline(always)]
fn attend_heads_body<T: Scalar>(
    query: &[T],
    keys: &[T],
    values: &[T],
    n_heads: usize,
    scores: &mut [T],
    context: &mut [T],
) {
    let (width, dim, n) = (query.len(), query.len() / n_heads, keys.len() / query.len());
    let padded = n.next_multiple_of(COLUMNS);
    let scores = &mut scores[..padded];
    for (head, (query, context)) in query.chunks_exact(dim).zip(context.chunks_exact_mut(dim)).enumerate() {
        for (score, key) in scores.iter_mut().zip(keys.chunks_exact(width)) {
            *score = inner_product(query, &key[head * dim..][..dim]);
        }
        softmax_body(scores, padded, n);
        context.fill(T::zero());
        for (weight, value) in scores.iter().zip(values.chunks_exact(width)) {
            add_scaled(context, *weight, &value[head * dim..][..dim]);
        }
    }
}
