//! Errors of 2D keypoints relative to the shoulder width (in a frontal view at the neck's distance). Models define a
//! shoulder or a hip differently from a skeleton, so errors are split: `bias` is the mean over a clip, `scatter` the
//! remainder. Only visible points that are detected are evaluated.

use super::clips::RenderedClip;
use crate::rendered_truth::Visibility;
use orator_base::math::order::Ordered;
use orator_base::types::pose2d::{VISIBLE_SCORE, coco};
use serde::Serialize;

/// Groups of points that are reported together, with their names.
pub const GROUPS: [(&str, &[usize]); 6] = [
    ("face", &[coco::NOSE, coco::L_EYE, coco::R_EYE, coco::L_EAR, coco::R_EAR]),
    ("shoulders", &[coco::L_SHOULDER, coco::R_SHOULDER]),
    ("elbows", &[coco::L_ELBOW, coco::R_ELBOW]),
    ("wrists", &[coco::L_WRIST, coco::R_WRIST]),
    ("hips", &[coco::L_HIP, coco::R_HIP]),
    ("legs", &[13, 14, 15, 16]),
];

/// Errors of one group of points.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PointErrors {
    pub points: &'static str,
    /// Number of visible points over all frames.
    pub n_visible: usize,
    /// Share of the visible points that were detected, 0..1.
    pub found: f64,
    /// Share of the hidden points that were detected, 0..1.
    pub false_positives: f64,
    /// Error relative to the shoulder width: median and 95th percentile.
    pub median: f64,
    pub p95: f64,
    /// Length of a clip's mean error, mean over clips and points.
    pub bias: f64,
    /// Median distance from the clip's mean error.
    pub scatter: f64,
}

/// Errors of the groups over clips.
pub fn errors(clips: &[&RenderedClip]) -> Vec<PointErrors> {
    GROUPS.iter().map(|(name, points)| of_group(name, points, clips)).collect()
}

fn of_group(name: &'static str, points: &[usize], clips: &[&RenderedClip]) -> PointErrors {
    let (mut distances, mut scatters, mut biases) = (Vec::new(), Vec::new(), Vec::new());
    let (mut n_visible, mut n_found, mut n_hidden, mut n_false_positives) = (0, 0, 0, 0);
    for clip in clips {
        for &point in points {
            let mut errors: Vec<[f64; 2]> = Vec::new();
            for t in 0..clip.n_frames() {
                let is_found = clip.keypoints.body[[t, point, 2]] > VISIBLE_SCORE;
                if clip.truth.body_visibility[[t, point]] != Visibility::Visible {
                    n_hidden += 1;
                    n_false_positives += usize::from(is_found);
                    continue;
                }
                n_visible += 1;
                if is_found {
                    n_found += 1;
                    errors.push(error(clip, t, point));
                }
            }
            let n = errors.len() as f64;
            let bias = [0, 1].map(|k| errors.iter().map(|e| e[k]).sum::<f64>() / n.max(1.0));
            if !errors.is_empty() {
                biases.push(bias[0].hypot(bias[1]));
            }
            distances.extend(errors.iter().map(|e| e[0].hypot(e[1])));
            scatters.extend(errors.iter().map(|e| (e[0] - bias[0]).hypot(e[1] - bias[1])));
        }
    }
    let distances = Ordered::new(distances);
    PointErrors {
        points: name,
        n_visible,
        found: share(n_found, n_visible),
        false_positives: share(n_false_positives, n_hidden),
        median: distances.quantile(0.5).unwrap_or(f64::NAN),
        p95: distances.quantile(0.95).unwrap_or(f64::NAN),
        bias: biases.iter().sum::<f64>() / (biases.len() as f64).max(1.0),
        scatter: Ordered::new(scatters).quantile(0.5).unwrap_or(f64::NAN),
    }
}

/// Error of a body point in a frame relative to the shoulder width: x to the right in the image, y down.
pub fn error(clip: &RenderedClip, t: usize, point: usize) -> [f64; 2] {
    let shoulders = f64::from(clip.shoulders_px(t)).max(1e-6);
    [0, 1].map(|k| f64::from(clip.keypoints.body[[t, point, k]] - clip.truth.body[[t, point, k]]) / shoulders)
}

/// Ratio of `part` to `whole`; 0 if `whole` is 0.
pub fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::people::clips::tests::exact;

    #[test]
    fn a_steady_shift_is_bias_and_a_shake_is_scatter() {
        let mut clip = exact();
        let shoulders = clip.shoulders_px(0);
        for t in 0..clip.n_frames() {
            let shake = if t % 2 == 0 { 0.02 } else { -0.02 };
            clip.keypoints.body[[t, coco::L_SHOULDER, 0]] += 0.1 * shoulders;
            clip.keypoints.body[[t, coco::L_WRIST, 1]] += shake * shoulders;
        }
        clip.keypoints.body[[5, coco::R_WRIST, 2]] = 0.0;
        clip.truth.body_visibility[[7, coco::R_WRIST]] = Visibility::BehindBody;
        let errors = errors(&[&clip]);
        let of = |name: &str| errors.iter().find(|e| e.points == name).unwrap();
        let (shoulders, wrists, elbows) = (of("shoulders"), of("wrists"), of("elbows"));
        assert!((shoulders.bias - 0.05).abs() < 1e-3 && shoulders.scatter < 1e-3, "{shoulders:?}");
        assert!(wrists.bias < 1e-3 && (wrists.p95 - 0.02).abs() < 1e-3, "{wrists:?}");
        assert_eq!((wrists.n_visible, wrists.false_positives), (79, 1.0));
        assert!((wrists.found - 78.0 / 79.0).abs() < 1e-9);
        assert!(elbows.median < 1e-3 && elbows.found == 1.0);
    }
}
