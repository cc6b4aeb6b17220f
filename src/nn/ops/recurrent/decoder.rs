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
