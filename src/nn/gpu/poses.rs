//! Forward kinematics and the losses of poses and scores on a GPU, each in one to three kernels. Poses are
//! [B, features, T] with three features per joint; further features follow those of the joints.

use super::launch::{blocks, result, run};
use super::layer::attached;
use candle_core::{Result, Tensor};

/// Converts raw features to normalised positions. `tables` has 14 values per bone: three each of mean and deviation of its
/// direction, then of its far end; its length; and its parent, or -1 for a bone at the neck. They are ordered by table.
pub fn kinematics(raw: &Tensor, tables: &Tensor) -> Result<Tensor> {
    let ((batch, features, n_frames), n_bones) = (raw.dims3()?, tables.elem_count() / 14);
    let (input, tables) = (raw.detach().contiguous()?, tables.clone());
    let ints = [batch, features, n_frames, n_bones];
    let y = result(raw.shape(), raw)?;
    let n_blocks = blocks(y.elem_count() / 3);
    run("kinematics_forward", &[Some(&input), Some(&tables), Some(&y)], &ints, &[], n_blocks)?;
    attached(y, raw, raw, move |grad| {
        let (grad, grad_raw) = (grad.contiguous()?, result(input.shape(), &input)?);
        let tensors = [Some(&input), Some(&tables), Some(&grad), Some(&grad_raw)];
        run("kinematics_backward", &tensors, &ints, &[], n_blocks)?;
        Ok(Some(grad_raw))
    })
}

/// Input of the discriminator: frame-to-frame differences [B, features, T - 1], 0 where the mask of either frame is 0, plus
/// noise. With `truth`, its differences come first, [2B, features, T - 1], and the result has no gradient.
pub fn motion(truth: Option<&Tensor>, poses: &Tensor, mask: &Tensor, noise: Option<&Tensor>) -> Result<Tensor> {
    let ((batch, features, n_frames), mask) = (poses.dims3()?, mask.contiguous()?);
    let n_parts = if truth.is_some() { 2 } else { 1 };
    let y = result((n_parts * batch, features, n_frames.saturating_sub(1)), poses)?;
    let (input, ints) = (poses.detach().contiguous()?, [batch * features, n_frames]);
    let tensors = [truth, Some(&input), Some(&mask), noise, Some(&y)];
    run("motion_forward", &tensors, &ints, &[], blocks(y.elem_count()))?;
    if truth.is_some() {
        return Ok(y);
    }
    attached(y, poses, poses, move |grad| {
        let grad_poses = result(input.shape(), &input)?;
        let tensors = [Some(&grad.contiguous()?), Some(&mask), Some(&grad_poses)];
        run("motion_backward", &tensors, &ints, &[], blocks(grad_poses.elem_count()))?;
        Ok(Some(grad_poses))
    })
}

/// Sum of L1, speed and energy loss of the first `n_joints` joints (L1: of all features), multiplied by `weights`. The three
/// losses themselves are written to `losses` [3].
pub fn pose_losses(
    [poses, truth, mask]: [&Tensor; 3],
    n_joints: usize,
    weights: [f64; 3],
    losses: &Tensor,
) -> Result<Tensor> {
    const N_SUMS: usize = 7;
    let (batch, features, n_frames) = poses.dims3()?;
    let [input, truth, mask] = [poses.detach().contiguous()?, truth.contiguous()?, mask.contiguous()?];
    let n_blocks = batch * features / 3;
    let (sums, total) = (result((n_blocks, N_SUMS), &input)?, result((), &input)?);
    let factors = result(2 + n_joints, &input)?;
    let tensors = [Some(&input), Some(&truth), Some(&mask), Some(&sums)];
    run("pose_sums", &tensors, &[features, n_frames, n_joints], &[], n_blocks)?;
    let tensors = [Some(&sums), Some(losses), Some(&total), Some(&factors)];
    run("pose_losses", &tensors, &[batch, features / 3, n_joints], &weights, 1)?;
    attached(total, poses, poses, move |grad| {
        let grad_poses = result(input.shape(), &input)?;
        let tensors = [Some(&input), Some(&truth), Some(&mask), Some(&factors), Some(grad), Some(&grad_poses)];
        run("pose_backward", &tensors, &[batch, features, n_frames, n_joints], &[], blocks(n_blocks * n_frames))?;
        Ok(Some(grad_poses))
    })
}

/// Adversarial term of a score, as `training.cu` numbers them; log(1 + e^score) is `Accepted`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScoreTerm {
    DistanceTo1 = 0,
    DistanceTo0 = 1,
    Rejected = 2,
    Accepted = 3,
    MinusAccepted = 4,
}

/// Mean of the first term over the first `n_first` scores (in memory), plus that of the second over the others; multiplied
/// by `weight`. The sum itself is written to `loss` [1].
pub fn score_losses(
    scores: &Tensor,
    n_first: usize,
    terms: [ScoreTerm; 2],
    weight: f64,
    loss: &Tensor,
) -> Result<Tensor> {
    let (input, total) = (scores.detach().contiguous()?, result((), scores)?);
    let grad_scores = result(scores.shape(), scores)?;
    let [first, second] = terms.map(|term| term as usize);
    let ints = [scores.elem_count(), n_first, first, second];
    run("score_losses", &[Some(&input), Some(loss), Some(&total), Some(&grad_scores)], &ints, &[weight], 1)?;
    attached(total, scores, scores, move |grad| Ok(Some(grad_scores.broadcast_mul(grad)?)))
}
