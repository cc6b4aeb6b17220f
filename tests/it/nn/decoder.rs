//! Recurrent decoder: gradients and equality with single steps.

use candle_core::{Result, Tensor, Var};
use orator_nn::cpu::vectorised::DropMask;
use orator_nn::ops::recurrent::cell::GruSizes;
use orator_nn::ops::recurrent::decoder::{DecoderInputs, DecoderWeights, TruePoses, decode};
use orator_nn::ops::recurrent::gru::{GruOptions, gru};
use orator_test_support::gradcheck::{check_thread_independence, max_difference, pattern, worst};

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
