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

/// Inputs of a decoder.
pub struct DecoderInputs<'a> {
    /// Poses [B, P, X] that are read before the first step; the last one is read again at the first step.
    pub previous: &'a Tensor,
    /// State [B, H] before these poses.
    pub state: &'a Tensor,
    /// Sequences [B, K, H] with separate attention, used both as keys and as values.
    pub keys: &'a [Tensor],
}

/// Weights of a decoder.
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
    let start = Tensor::cat(&[&inputs.previous.reshape((batch, n_previous * pose))?, inputs.state], 1)?;
    let keys = match inputs.keys {
        [one] => one.contiguous()?,
        several => Tensor::cat(several, 1)?,
    };
    let all = Tensor::cat(&[weights.gru, &weights.weight.flatten_all()?, weights.bias], 0)?;
    let n_keys = inputs.keys.iter().map(|keys| keys.dim(1)).collect::<Result<Vec<_>>>()?;
    let cell = GruSizes { input: pose, hidden: inputs.state.dim(1)? };
    let sizes = DecoderSizes { batch, n_previous, n_steps, cell, n_keys, chunk: chunk_rows(batch) };
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

    const CELL: GruSizes = GruSizes { input: 3, hidden: 4 };

    /// Previous poses, state, two sequences of keys, weights of the GRU and the output.
    fn shapes(batch: usize) -> [Vec<usize>; 7] {
        let (previous, state) = (vec![batch, 2, 3], vec![batch, 4]);
        [previous, state, vec![batch, 5, 4], vec![batch, 2, 4], vec![CELL.n_weights()], vec![3, 12], vec![3]]
    }

    fn inputs(batch: usize) -> Result<Vec<Tensor>> {
        shapes(batch).iter().enumerate().map(|(i, shape)| pattern(shape, 11.0 * i as f64)).collect()
    }

    fn fused(v: &[Tensor], mask: Option<DropMask>) -> Result<Tensor> {
        let inputs = DecoderInputs { previous: &v[0], state: &v[1], keys: &v[2..4] };
        decode(&inputs, &DecoderWeights { gru: &v[4], weight: &v[5], bias: &v[6] }, 3, mask)
    }

    fn composed(v: &[Tensor]) -> Result<Tensor> {
        let options = GruOptions { n_directions: 1, last: true, mask: None };
        let mut state = gru(&v[0], &v[1].unsqueeze(0)?, &v[4], options)?;
        let (mut pose, mut poses) = (v[0].narrow(1, 1, 1)?.contiguous()?, Vec::new());
        for _ in 0..3 {
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
            let off = max_difference(&inputs, |v| fused(v, None), composed)?;
            let error = worst(&inputs, |v| fused(v, None))?;
            let dropped = worst(&inputs, |v| fused(v, Some(DropMask::new(9, 0.5))))?;
            assert!(off < 1e-12 && error < 1e-7 && dropped < 1e-7, "{off:e} {error:e} {dropped:e}");
        }
        Ok(())
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
        let shapes = shapes(150);
        let shapes: Vec<&[usize]> = shapes.iter().map(Vec::as_slice).collect();
        check_thread_independence(&shapes, 4, |v| fused(v, Some(DropMask::new(3, 0.5))))
    }

    #[test]
    fn mismatched_shapes_are_errors() -> Result<()> {
        let good = inputs(2)?;
        assert!(fused(&good, None).is_ok());
        for (which, dim) in [(1, 0), (2, 2), (4, 0), (5, 1), (6, 0)] {
            let mut v = good.clone();
            v[which] = v[which].narrow(dim, 0, 1)?;
            assert!(fused(&v, None).is_err(), "{which}");
        }
        Ok(())
    }
}
