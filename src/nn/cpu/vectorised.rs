//! Row-wise operations of recurrent networks, compiled for AVX-512, for AVX2 and for any processor: the gates of a
//! GRU, attention of one state over keys, dropout. Row lengths are multiples of [`COLUMNS`], padded with zeros.

use super::packed_matrix::COLUMNS;
use super::tensor::Scalar;

/// Defines a function whose loops are compiled for each processor type.
macro_rules! vectorised {
    ($(#[$doc:meta])* $name:ident = $body:ident($($argument:ident: $type:ty),*)) => {
        $(#[$doc])*
        pub fn $name<T: Scalar>($($argument: $type),*) {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl")]
                fn wide<T: Scalar>($($argument: $type),*) {
                    $body($($argument),*);
                }
                #[target_feature(enable = "avx2,fma")]
                fn half<T: Scalar>($($argument: $type),*) {
                    $body($($argument),*);
                }
                if std::arch::is_x86_feature_detected!("avx512dq") && std::arch::is_x86_feature_detected!("avx512bw")
                    && std::arch::is_x86_feature_detected!("avx512vl")
                {
                    // SAFETY: the processor supports the features that the function is compiled for.
                    return unsafe { wide($($argument),*) };
                }
                if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
                    // SAFETY: the processor supports the features that the function is compiled for.
                    return unsafe { half($($argument),*) };
                }
            }
            $body($($argument),*);
        }
    };
}

pub(super) use vectorised;

vectorised!(
    /// Gates of a GRU. Each row of `sums` consists of four parts of length `width`: the input's contribution to the
    /// candidate, the sum of the reset gate, the sum of the update gate, and the state's contribution to the
    /// candidate. The first three are overwritten with candidate n, reset r and update z. `next = (1 - z) n + z
    /// previous`, with n = tanh(input + r state).
    gates_forward = forward_body(sums: &mut [T], previous: &[T], next: &mut [T], width: usize)
);

#[inline(always)]
fn forward_body<T: Scalar>(sums: &mut [T], previous: &[T], next: &mut [T], width: usize) {
    let rows = previous.chunks_exact(width).zip(next.chunks_exact_mut(width));
    for (sums, (previous, next)) in sums.chunks_exact_mut(4 * width).zip(rows) {
        let (candidate, sums) = sums.split_at_mut(width);
        let (reset, sums) = sums.split_at_mut(width);
        let (update, state) = sums.split_at_mut(width);
        // Lanes on the stack, because loops over slices that may overlap are not vectorised.
        for at in (0..width).step_by(COLUMNS) {
            let (mut n, mut r, mut z) = (lanes(candidate, at), lanes(reset, at), lanes(update, at));
            let (state, mut next_state) = (lanes(state, at), lanes(previous, at));
            for i in 0..COLUMNS {
                r[i] = sigmoid(r[i]);
                z[i] = sigmoid(z[i]);
                n[i] = tanh(n[i] + r[i] * state[i]);
                next_state[i] = n[i] + z[i] * (next_state[i] - n[i]);
            }
            candidate[at..][..COLUMNS].copy_from_slice(&n);
            reset[at..][..COLUMNS].copy_from_slice(&r);
            update[at..][..COLUMNS].copy_from_slice(&z);
            next[at..][..COLUMNS].copy_from_slice(&next_state);
        }
    }
}

/// Copies `COLUMNS` values from position `at` on.
#[inline(always)]
fn lanes<T: Scalar>(row: &[T], at: usize) -> [T; COLUMNS] {
    let mut lanes = [T::zero(); COLUMNS];
    lanes.copy_from_slice(&row[at..at + COLUMNS]);
    lanes
}

vectorised!(
    /// Gradients of the gates' sums, in the order of `gates`, which [`gates_forward`] has written. `grad`, the
    /// gradient of the next state, is overwritten with the part of the previous state's gradient that does not pass
    /// through the gates.
    gates_backward = backward_body(gates: &[T], previous: &[T], grad: &mut [T], of_sums: &mut [T], width: usize)
);

#[inline(always)]
fn backward_body<T: Scalar>(gates: &[T], previous: &[T], grad: &mut [T], of_sums: &mut [T], width: usize) {
    let one = T::one();
    let rows = gates.chunks_exact(4 * width).zip(of_sums.chunks_exact_mut(4 * width));
    for ((gates, of_sums), (previous, grad)) in rows.zip(previous.chunks_exact(width).zip(grad.chunks_exact_mut(width)))
    {
        let (candidate, gates) = gates.split_at(width);
        let (reset, gates) = gates.split_at(width);
        let (update, state) = gates.split_at(width);
        let (of_candidate, of_sums) = of_sums.split_at_mut(width);
        let (of_reset, of_sums) = of_sums.split_at_mut(width);
        let (of_update, of_state) = of_sums.split_at_mut(width);
        for i in 0..width {
            let (n, r, z) = (candidate[i], reset[i], update[i]);
            let of_n = grad[i] * (one - z) * (one - n * n);
            of_candidate[i] = of_n;
            of_reset[i] = of_n * state[i] * r * (one - r);
            of_update[i] = grad[i] * (previous[i] - n) * z * (one - z);
            of_state[i] = of_n * r;
            grad[i] *= z;
        }
    }
}

#[inline(always)]
fn sigmoid<T: Scalar>(x: T) -> T {
    T::one() / (T::one() + (T::zero() - x).fast_exp())
}

#[inline(always)]
fn tanh<T: Scalar>(x: T) -> T {
    let two = T::one() + T::one();
    two * sigmoid(two * x) - T::one()
}

vectorised!(
    /// Attention of a state over as many keys as there are `weights`: weights = softmax of the inner products, context
    /// = sum of the weighted keys.
    attend = attend_body(state: &[T], keys: &[T], weights: &mut [T], context: &mut [T])
);

#[inline(always)]
fn attend_body<T: Scalar>(state: &[T], keys: &[T], weights: &mut [T], context: &mut [T]) {
    let mut max = T::zero();
    for (i, (weight, key)) in weights.iter_mut().zip(keys.chunks_exact(state.len())).enumerate() {
        *weight = inner_product(state, key);
        max = if i == 0 || *weight > max { *weight } else { max };
    }
    let mut total = T::zero();
    for weight in weights.iter_mut() {
        *weight = (*weight - max).fast_exp();
        total += *weight;
    }
    context.fill(T::zero());
    for (weight, key) in weights.iter_mut().zip(keys.chunks_exact(state.len())) {
        *weight /= total;
        add_scaled(context, *weight, key);
    }
}

#[derive(Clone, Copy)]
pub struct Attended<'a, T> {
    pub state: &'a [T],
    pub keys: &'a [T],
    pub weights: &'a [T],
    /// Gradient of the context.
    pub grad: &'a [T],
}

vectorised!(
    /// Adds the gradients of an attention to those of its state and keys.
    attend_backward = attend_backward_body(of: Attended<'_, T>, of_state: &mut [T], of_keys: &mut [T])
);

#[inline(always)]
fn attend_backward_body<T: Scalar>(of: Attended<'_, T>, of_state: &mut [T], of_keys: &mut [T]) {
    let width = of.state.len();
    let mut mean = T::zero();
    for (weight, key) in of.weights.iter().zip(of.keys.chunks_exact(width)) {
        mean += *weight * inner_product(of.grad, key);
    }
    for ((weight, key), of_key) in
        of.weights.iter().zip(of.keys.chunks_exact(width)).zip(of_keys.chunks_exact_mut(width))
    {
        let of_score = *weight * (inner_product(of.grad, key) - mean);
        add_scaled(of_state, of_score, key);
        add_scaled(of_key, of_score, of.state);
        add_scaled(of_key, *weight, of.grad);
    }
}

#[inline(always)]
pub(super) fn inner_product<T: Scalar>(a: &[T], b: &[T]) -> T {
    let mut lanes = [T::zero(); COLUMNS];
    for (a, b) in a.as_chunks::<COLUMNS>().0.iter().zip(b.as_chunks::<COLUMNS>().0) {
        for i in 0..COLUMNS {
            lanes[i] += a[i] * b[i];
        }
    }
    lanes.iter().fold(T::zero(), |sum, lane| sum + *lane)
}

#[inline(always)]
pub(super) fn add_scaled<T: Scalar>(to: &mut [T], scale: T, row: &[T]) {
    to.iter_mut().zip(row).for_each(|(to, value)| *to += scale * *value);
}

/// Dropout mask as a function of a seed and a value's position, so that no mask is stored.
#[derive(Clone, Copy, Debug)]
pub struct DropMask {
    seed: u32,
    threshold: u32,
    /// Factor of the kept values.
    pub scale: f64,
}

impl DropMask {
    /// Drops a fraction `p` of the values, 0 <= p < 1.
    pub fn new(seed: u32, p: f64) -> Self {
        Self { seed, threshold: (p * f64::from(u32::MAX)) as u32, scale: 1.0 / (1.0 - p) }
    }
}

vectorised!(
    /// Applies dropout to `values`; `first` is the position of the first value in the complete array.
    drop_out = drop_body(values: &mut [T], first: usize, mask: DropMask)
);

#[inline(always)]
fn drop_body<T: Scalar>(values: &mut [T], first: usize, mask: DropMask) {
    let (scale, start) = (T::from_f64(mask.scale), first as u32);
    for (i, value) in values.iter_mut().enumerate() {
        // Finaliser of MurmurHash3.
        let mut hash = start.wrapping_add(i as u32).wrapping_mul(0x9e37_79b9) ^ mask.seed;
        hash = (hash ^ (hash >> 16)).wrapping_mul(0x85eb_ca6b);
        hash = (hash ^ (hash >> 13)).wrapping_mul(0xc2b2_ae35);
        hash ^= hash >> 16;
        *value = if hash < mask.threshold { T::zero() } else { *value * scale };
    }
}

/// e^x to 2 units in the last place (range reduction and polynomial of Cephes), branch-free, so loops are vectorised.
#[inline(always)]
pub fn exp_f32(x: f32) -> f32 {
    /// Adding it to a number of moderate size leaves the number's integer part in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    let x = x.clamp(-87.0, 88.0);
    let rounded = x * std::f32::consts::LOG2_E + ROUND;
    let n = rounded - ROUND;
    // ln 2 in two parts, the first with few digits.
    let rest = x - n * 0.693_359_4 + n * 2.121_944_4e-4;
    let series = ((((1.987_569_1e-4 * rest + 1.398_199_9e-3) * rest + 8.333_452e-3) * rest + 4.166_579_6e-2) * rest
        + 1.666_666_5e-1)
        * rest
        + 0.5;
    let of_rest = series * rest * rest + rest + 1.0;
    of_rest * f32::from_bits((rounded.to_bits() << 23).wrapping_add(0x3f80_0000))
}
