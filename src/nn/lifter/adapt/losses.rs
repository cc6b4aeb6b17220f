//! Losses of an adaptation (Pavllo et al. 2019, section 4): the projection of the pose meets the keypoints, every bone
//! has one length, and labelled windows give the known positions.

use super::samples::{GROUP, LabelledWindows, OwnWindows, WEIGHTS};
use super::skeleton::{ArmLengths, KINDS, MIN_DEPTH};
use candle_core::{Device, Result, Shape, Tensor};
use orator_base::motion::upper_body::{L_SHOULDER, N_POINTS, R_SHOULDER, REFERENCE_SIZE};
use orator_base::types::skeleton::BODY_BONES;

/// Weight of each of the `BODY_BONES` in the size of a body (`upper_body::size`).
const SHARES: [f32; 5] = [1.0, 0.5, 0.5, 0.5, 0.5];

/// Mean distance of the output [B, 27] to the known positions, in units of the window.
pub fn labelled(output: &Tensor, windows: &LabelledWindows) -> Result<Tensor> {
    let n = output.dim(0)?;
    let targets = like(output, &windows.targets, (n, N_POINTS, 3))?;
    let mean = WEIGHTS.iter().sum::<f32>() / N_POINTS as f32;
    let weights = like(output, &WEIGHTS.map(|weight| weight / mean), (1, N_POINTS))?;
    distance(&(output.reshape((n, N_POINTS, 3))? - targets)?)?.broadcast_mul(&weights)?.mean_all()
}

/// Mean distance of the projection to the visible keypoints, in units of the window, plus the mean relative deviation
/// of the arm bones from the speaker's lengths at the size of their group. The output [B, 27] fixes the trajectory of
/// the neck: it is at the keypoints' neck, at the depth where one unit in the picture is one unit of the pose.
pub fn own(output: &Tensor, windows: &OwnWindows, lengths: &ArmLengths) -> Result<Tensor> {
    let n = output.dim(0)?;
    let seen = like(output, &windows.seen, (n, N_POINTS, 3))?;
    let pose = (output.reshape((n, N_POINTS, 3))? + &seen)?;
    let neck = ((pose.narrow(1, R_SHOULDER, 1)? + pose.narrow(1, L_SHOULDER, 1)?)? * 0.5)?;
    let pose = pose.broadcast_sub(&neck)?;

    let neck = like(output, &windows.neck, (n, 1, 2))?;
    let per_focal = like(output, &windows.per_focal, (n, 1, 1))?;
    let depth = (pose.narrow(2, 2, 1)?.broadcast_mul(&per_focal)? + 1.0)?.maximum(MIN_DEPTH)?;
    let projected = pose.narrow(2, 0, 2)?.broadcast_add(&neck)?.broadcast_div(&depth)?;
    let keypoints = seen.narrow(2, 0, 2)?.broadcast_add(&neck)?;
    let total = windows.weights.iter().sum::<f32>().max(1e-6);
    let weights: Vec<f32> = windows.weights.iter().map(|weight| weight / total).collect();
    let reprojection = (distance(&(projected - keypoints)?)? * like(output, &weights, (n, N_POINTS))?)?.sum_all()?;

    let ends = |which: fn((usize, usize)) -> usize| {
        let ends = BODY_BONES.map(|bone| which(bone) as u32);
        pose.index_select(&Tensor::new(&ends, &Device::Cpu)?, 1)
    };
    let bones = distance(&(ends(|(from, _)| from)? - ends(|(_, to)| to)?)?)?;
    let bones = bones.broadcast_mul(&like(output, &windows.scales, (n, 1))?)?.reshape((n / GROUP, GROUP, 5))?;
    let size = bones.broadcast_mul(&like(output, &SHARES, (1, 1, 5))?)?.sum_keepdim(2)?.mean_keepdim(1)?;
    let shares = KINDS.map(|kind| (lengths[kind] / REFERENCE_SIZE) as f32);
    let expected = size.broadcast_mul(&like(output, &shares, (1, 1, 5))?)?;
    let change = (bones.broadcast_div(&expected)? - 1.0)?.abs()?.mean_all()?;
    reprojection + change
}

/// Length of the vectors along the last of three axes.
fn distance(vectors: &Tensor) -> Result<Tensor> {
    (vectors.sqr()?.sum(2)? + 1e-8)?.sqrt()
}

/// Constant of the type of `other`.
fn like(other: &Tensor, values: &[f32], shape: impl Into<Shape>) -> Result<Tensor> {
    Tensor::from_slice(values, shape, &Device::Cpu)?.to_dtype(other.dtype())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::gradcheck::{pattern, worst};

    /// Windows of an upright body, 300 px large, whose keypoints are exact for the output 0 except for depth.
    fn windows() -> OwnWindows {
        let n = 2 * GROUP;
        let xs: [f32; N_POINTS] = [0.0, -0.5, -0.6, -0.5, 0.5, 0.6, 0.5, -0.3, 0.3];
        let ys: [f32; N_POINTS] = [-0.6, 0.0, 0.9, 1.5, 0.0, 0.9, 1.5, 1.4, 1.4];
        let body = xs.into_iter().zip(ys).flat_map(|(x, y)| [x, y, 0.0]);
        OwnWindows {
            numbers: Vec::new(),
            seen: (0..n).flat_map(|_| body.clone()).collect(),
            weights: (0..n).flat_map(|_| WEIGHTS).collect(),
            neck: (0..n).flat_map(|i| [0.1 * i as f32, -0.4]).collect(),
            per_focal: vec![0.15; n],
            scales: (0..n).map(|i| 0.9 + 0.2 * (i % 2) as f32).collect(),
        }
    }

    #[test]
    fn gradients_agree_with_finite_differences() -> anyhow::Result<()> {
        let (windows, lengths) = (windows(), [0.3, 0.34, 0.26]);
        let output = (pattern(&[2 * GROUP, 3 * N_POINTS], 2.0)? * 0.3)?;
        let error = worst(std::slice::from_ref(&output), |v| own(&v[0], &windows, &lengths)?.unsqueeze(0))?;
        assert!(error < 1e-6, "{error:e}");
        let targets = (0..2 * GROUP * 3 * N_POINTS).map(|i| (i as f32 * 0.7).sin()).collect();
        let known = LabelledWindows { numbers: Vec::new(), targets };
        let error = worst(&[output], |v| labelled(&v[0], &known)?.unsqueeze(0))?;
        assert!(error < 1e-6, "{error:e}");
        Ok(())
    }

    #[test]
    fn the_true_pose_has_no_loss() -> anyhow::Result<()> {
        // In the plane of the picture the projection is the pose itself; the bones then have the lengths given here.
        let windows = OwnWindows { scales: vec![1.0; 2 * GROUP], ..windows() };
        let bones = [1.0, 0.1f64.hypot(0.9), 0.1f64.hypot(0.6)];
        let sum: f64 = bones.iter().sum();
        let zero = pattern(&[2 * GROUP, 3 * N_POINTS], 0.0)?.zeros_like()?;
        let loss = |lengths: ArmLengths| own(&zero, &windows, &lengths)?.to_scalar::<f64>();
        let right = loss(bones.map(|bone| bone * REFERENCE_SIZE / sum))?;
        assert!(right < 1e-3, "{right}");
        assert!(loss([0.4, 0.3, 0.2])? > 0.05);
        Ok(())
    }
}
