//! A decoder that continues given poses: a GRU reads them, then its own last pose at every step, attends to encoded
//! sequences by inner products (Luong 2015, "dot") and computes the next pose from state and contexts. The complete
//! loop, with backpropagation through time, is one operator, because twenty steps of small products would otherwise be
//! several hundred operators in each direction.

use super::cell::{GruSizes, SavedChunks, chunk_rows, sum_chunks};
use super::decoder_pass::{BackwardDecoder, DecoderSizes, ForwardDecoder};
use crate::cpu::spin_pool::parallel_each;
use crate::cpu::tensor::Scalar;
use crate::cpu::vectorised::DropMask;
use crate::ops::operator::{CpuOperator, CustomOperator, Gradients, Operand};
use candle_core::{Result, Shape, Tensor};

/// True poses that some decoder steps read instead of the computed ones (scheduled sampling, Bengio et al. 2015).
#[derive(Clone, Copy, Debug)]
pub struct TruePoses<'a> {
    /// True poses [B, N, X] of the steps; they get no gradient.
    pub poses: &'a Tensor,
    /// B * N entries, row-major: whether step t of sample b reads the true pose of step t - 1, not the computed,
    /// which then gets no gradient from it. Those of t = 0 have no effect: the first step reads the last previous pose.
    pub taken: &'a [bool],
}

pub struct DecoderInputs<'a> {
    /// Poses [B, P, X] that are read before the first step; the last one is read again at the first step.
    pub previous: &'a Tensor,
    /// State [B, H] before these poses.
    pub state: &'a Tensor,
    /// Sequences [B, K, H] with separate attention, used both as keys and as values.
    pub keys: &'a [Tensor],
    /// True poses for the training with scheduled sampling.
    pub truth: Option<&'a TruePoses<'a>>,
}

pub struct DecoderWeights<'a> {
    /// Weights of the GRU as one flat tensor.
    pub gru: &'a Tensor,
    /// [X, (1 + sequences) H] over the concatenation of state and contexts; below, the bias [X].
    pub weight: &'a Tensor,
    pub bias: &'a Tensor,
}

/// Computes `n_steps` poses [B, N, X]. `mask` is the dropout of state and contexts, concatenated, at every step.
pub fn decode(
    inputs: &DecoderInputs,
    weights: &DecoderWeights,
    n_steps: usize,
    mask: Option<DropMask>,
) -> Result<Tensor> {
    let (batch, n_previous, pose) = inputs.previous.dims3()?;
    let mut start = vec![inputs.previous.reshape((batch, n_previous * pose))?];
    if let Some(TruePoses { poses, taken }) = inputs.truth {
        if poses.dims() != [batch, n_steps, pose] || taken.len() != batch * n_steps {
            candle_core::bail!(
                "decoder: true poses {:?} with {} entries do not fit {n_steps} steps after poses {:?}",
                poses.dims(),
                taken.len(),
                inputs.previous.dims()
            );
        }
        start.push(poses.detach().reshape((batch, n_steps * pose))?);
    }
    start.push(inputs.state.clone());
    let start = Tensor::cat(&start, 1)?;
    let keys = match inputs.keys {
        [one] => one.contiguous()?,
        several => Tensor::cat(several, 1)?,
    };
    let all = Tensor::cat(&[weights.gru, &weights.weight.flatten_all()?, weights.bias], 0)?;
    let n_keys = inputs.keys.iter().map(|keys| keys.dim(1)).collect::<Result<Vec<_>>>()?;
    let cell = GruSizes { input: pose, hidden: inputs.state.dim(1)? };
    let taken = inputs.truth.map_or_else(Vec::new, |truth| truth.taken.to_vec());
    let sizes = DecoderSizes { batch, n_previous, n_steps, cell, n_keys, chunk: chunk_rows(batch), taken };
    if weights.weight.dims() != [pose, sizes.n_read() * cell.hidden] {
        candle_core::bail!(
            "decoder: output weights {:?} do not fit poses {:?}",
            weights.weight.dims(),
            inputs.previous.dims()
        );
    }
    let saves = start.track_op() || keys.track_op() || all.track_op();
    start.apply_op3(&keys, &all, CustomOperator(DecoderOp { sizes, mask, saves, saved: SavedChunks::default() }))
}

struct DecoderOp {
    sizes: DecoderSizes,
    mask: Option<DropMask>,
    saves: bool,
    saved: SavedChunks,
}

impl CpuOperator for DecoderOp {
    const NAME: &'static str = "decoder with attention";

    fn forward<T: Scalar>(&self, [start, keys, weights]: [Operand<T>; 3]) -> Result<(Vec<T>, Shape)> {
        let s = &self.sizes;
        s.check(start.dims, keys.dims, weights.values.len())?;
        let (row, keys_row) = (s.n_steps * s.cell.input, s.all_keys() * s.cell.hidden);
        let decoder = ForwardDecoder::new(s, self.mask, weights.values);
        let mut y = vec![T::zero(); s.batch * row];
        let chunks = start.values.chunks(s.chunk * s.start_len()).zip(keys.values.chunks(s.chunk * keys_row));
        let saved = parallel_each(y.chunks_mut(s.chunk * row).zip(chunks), |chunk, (y, (start, keys))| {
            let saved = decoder.run(chunk * s.chunk, start, keys, y);
            if self.saves { saved } else { Vec::new() }
        });
        if self.saves {
            self.saved.put(saved);
        }
        Ok((y, Shape::from((s.batch, s.n_steps, s.cell.input))))
    }

    fn backward<T: Scalar>(&self, [start, keys, weights]: [Operand<T>; 3], y: &[T], grad: &[T]) -> Gradients<T> {
        let s = &self.sizes;
        let saved = self.saved.get::<T>()?;
        let (row, keys_row) = (s.n_steps * s.cell.input, s.all_keys() * s.cell.hidden);
        let decoder = BackwardDecoder::new(s, self.mask, weights.values);
        let mut of_start = vec![T::zero(); start.values.len()];
        let mut of_keys = vec![T::zero(); keys.values.len()];
        let inputs = start.values.chunks(s.chunk * s.start_len()).zip(keys.values.chunks(s.chunk * keys_row));
        let outputs = y.chunks(s.chunk * row).zip(grad.chunks(s.chunk * row));
        let results =
            of_start.chunks_mut(s.chunk * s.start_len()).zip(of_keys.chunks_mut(s.chunk * keys_row)).zip(saved);
        let of_weights = parallel_each(results.zip(inputs.zip(outputs)), |chunk, (results, (inputs, outputs))| {
            let ((of_start, of_keys), saved) = results;
            decoder.run(chunk * s.chunk, inputs, outputs, saved, of_start, of_keys)
        });
        Ok([
            start.tracked.then_some(of_start),
            keys.tracked.then_some(of_keys),
            weights.tracked.then(|| sum_chunks(&of_weights)),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::gradcheck::{check_thread_independence, max_difference, pattern, worst};
    use crate::ops::recurrent::gru::{GruOptions, gru};
    use candle_core::Var;

    const CELL: GruSizes = GruSizes { input: 3, hidden: 4 };

    /// Previous poses, state, two sequences of keys, weights of the GRU and the output.
    fn shapes(batch: usize) -> [Vec<usize>; 7] {
        let (previous, state) = (vec![batch, 2, 3], vec![batch, 4]);
        [previous, state, vec![batch, 5, 4], vec![batch, 2, 4], vec![CELL.n_weights()], vec![3, 12], vec![3]]
    }

    fn inputs(batch: usize) -> Result<Vec<Tensor>> {
        shapes(batch).iter().enumerate().map(|(i, shape)| pattern(shape, 11.0 * i as f64)).collect()
    }

    fn fused(v: &[Tensor], truth: Option<&TruePoses>, mask: Option<DropMask>) -> Result<Tensor> {
        let inputs = DecoderInputs { previous: &v[0], state: &v[1], keys: &v[2..4], truth };
        decode(&inputs, &DecoderWeights { gru: &v[4], weight: &v[5], bias: &v[6] }, 3, mask)
    }

    /// Input [B, 1, X] of step `t` > 0, composed of the computed poses of the preceding step and the true ones.
    fn mixed(pose: &Tensor, truth: &TruePoses, t: usize) -> Result<Tensor> {
        let row = |b: usize| match truth.taken[3 * b + t] {
            true => truth.poses.narrow(0, b, 1)?.narrow(1, t - 1, 1),
            false => pose.narrow(0, b, 1),
        };
        Tensor::cat(&(0..pose.dim(0)?).map(row).collect::<Result<Vec<_>>>()?, 0)
    }

    fn composed(v: &[Tensor], truth: Option<&TruePoses>) -> Result<Tensor> {
        let options = GruOptions { n_directions: 1, last: true, mask: None };
        let mut state = gru(&v[0], &v[1].unsqueeze(0)?, &v[4], options)?;
        let (mut pose, mut poses) = (v[0].narrow(1, 1, 1)?.contiguous()?, Vec::new());
        for t in 0..3 {
            if let Some(truth) = truth.filter(|_| t > 0) {
                pose = mixed(&pose, truth, t)?;
            }
            state = gru(&pose, &state.unsqueeze(0)?, &v[4], options)?;
            let mut read = vec![state.clone()];
            for keys in &v[2..4] {
                let scores = keys.broadcast_mul(&state.unsqueeze(1)?)?.sum_keepdim(2)?.exp()?;
                let weights = scores.broadcast_div(&scores.sum_keepdim(1)?)?;
                read.push(keys.broadcast_mul(&weights)?.sum(1)?);
            }
            pose = Tensor::cat(&read, 1)?.matmul(&v[5].t()?)?.broadcast_add(&v[6])?.unsqueeze(1)?;
            poses.push(pose.clone());
        }
        Tensor::cat(&poses, 1)
    }

    #[test]
    fn decoder_equals_the_composed_one_and_gradients_are_correct() -> Result<()> {
        for batch in [2, 9] {
            let inputs = inputs(batch)?;
            // True poses as inputs of no step, of some steps of every sample, and of all steps but the first.
            let poses = pattern(&[batch, 3, 3], 77.0)?;
            let some: Vec<bool> = (0..3 * batch).map(|i| (i / 3 + i % 3) % 2 == 1).collect();
            let all = vec![true; 3 * batch];
            let [some, all] = [&some, &all].map(|taken| TruePoses { poses: &poses, taken });
            for truth in [None, Some(&some), Some(&all)] {
                let off = max_difference(&inputs, |v| fused(v, truth, None), |v| composed(v, truth))?;
                let error = worst(&inputs, |v| fused(v, truth, None))?;
                let dropped = worst(&inputs, |v| fused(v, truth, Some(DropMask::new(9, 0.5))))?;
                assert!(off < 1e-12 && error < 1e-7 && dropped < 1e-7, "{off:e} {error:e} {dropped:e}");
            }
        }
        Ok(())
    }

    #[test]
    fn true_poses_get_no_gradient_and_change_nothing_unless_taken() -> Result<()> {
        let (inputs, poses) = (inputs(9)?, Var::from_tensor(&pattern(&[9, 3, 3], 77.0)?)?);
        let truth = |taken| TruePoses { poses: &poses, taken };
        let (mask, none) = (Some(DropMask::new(9, 0.5)), [false; 27]);
        let off = max_difference(&inputs, |v| fused(v, Some(&truth(&none)), mask), |v| fused(v, None, mask))?;
        assert_eq!(off, 0.0);
        let vars = inputs.iter().map(Var::from_tensor).collect::<Result<Vec<_>>>()?;
        let tracked: Vec<Tensor> = vars.iter().map(|var| var.as_tensor().clone()).collect();
        let gradients = fused(&tracked, Some(&truth(&[true; 27])), None)?.sum_all()?.backward()?;
        assert!(gradients.get(&vars[0]).is_some() && gradients.get(&poses).is_none());
        Ok(())
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
        let shapes = shapes(150);
        let shapes: Vec<&[usize]> = shapes.iter().map(Vec::as_slice).collect();
        let poses = pattern(&[150, 3, 3], 77.0)?.to_dtype(candle_core::DType::F32)?;
        let taken: Vec<bool> = (0..450).map(|i| i % 4 < 2).collect();
        let truth = TruePoses { poses: &poses, taken: &taken };
        for truth in [None, Some(&truth)] {
            check_thread_independence(&shapes, 4, |v| fused(v, truth, Some(DropMask::new(3, 0.5))))?;
        }
        Ok(())
    }

    #[test]
    fn mismatched_shapes_are_errors() -> Result<()> {
        let good = inputs(2)?;
        assert!(fused(&good, None, None).is_ok());
        for (which, dim) in [(1, 0), (2, 2), (4, 0), (5, 1), (6, 0)] {
            let mut v = good.clone();
            v[which] = v[which].narrow(dim, 0, 1)?;
            assert!(fused(&v, None, None).is_err(), "{which}");
        }
        for (shape, n_taken, fits) in [([2, 3, 3], 6, true), ([2, 2, 3], 6, false), ([2, 3, 3], 5, false)] {
            let truth = TruePoses { poses: &pattern(&shape, 0.0)?, taken: &vec![true; n_taken] };
            assert_eq!(fused(&good, Some(&truth), None).is_ok(), fits, "{shape:?} {n_taken}");
        }
        Ok(())
    }
}
