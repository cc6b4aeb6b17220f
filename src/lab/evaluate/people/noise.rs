//! Errors of a model set on rendered persons, fitted as the noise model with which lifters are trained
//! (`train::scene::noise`): least squares for the bias, then robust deviations of the residuals.

use super::bias_fit::{self, OUTLIER_STDS, deviation};
use super::clips::RenderedClip;
use crate::rendered_truth::Visibility;
use crate::train::scene::noise::{FrameNoise, KeypointNoise, N_BASIS, PointNoise, Runs, basis, kind};
use orator_base::math::order::{Ordered, median};
use orator_base::motion::upper_body::{BodyPoints, COCO, N_POINTS};
use orator_base::types::pose2d::VISIBLE_SCORE;

/// Error of a point in shoulder widths, and the basis vectors of its bias.
type PointError = ([f64; 2], [[f64; 2]; N_BASIS]);

/// Errors of one point over a clip.
struct PointTrack {
    /// `None`: not detected, or outside the image.
    errors: Vec<Option<PointError>>,
    /// Whether the point is inside the image, and whether it is hidden.
    inside: Vec<bool>,
    hidden: Vec<bool>,
}

/// Fits the noise of the model set `set` over clips.
pub fn fit(set: &str, clips: &[RenderedClip]) -> KeypointNoise {
    let points = std::array::from_fn(|of_kind| {
        let points = (0..N_POINTS).filter(|&point| kind(point) == of_kind);
        let tracks: Vec<PointTrack> =
            points.flat_map(|point| clips.iter().map(move |clip| PointTrack::new(clip, point))).collect();
        fit_point(&tracks)
    });
    KeypointNoise { set: set.to_owned(), points }
}

impl PointTrack {
    fn new(clip: &RenderedClip, point: usize) -> Self {
        let coco = COCO[point];
        let seen = |t: usize| clip.truth.body_visibility[[t, coco]];
        let error = |t: usize| {
            let is_found = clip.keypoints.body[[t, coco, 2]] > VISIBLE_SCORE;
            if !is_found || seen(t) == Visibility::Outside {
                return None;
            }
            let truth: BodyPoints = COCO.map(|c| Some([0, 1].map(|k| clip.truth.body[[t, c, k]])));
            Some((super::points::error(clip, t, coco), basis(&truth, point, f64::from(clip.shoulders_px(t)))?))
        };
        let frames = 0..clip.n_frames();
        Self {
            errors: frames.clone().map(error).collect(),
            inside: frames.clone().map(|t| seen(t) != Visibility::Outside).collect(),
            hidden: frames.map(|t| !matches!(seen(t), Visibility::Visible | Visibility::Outside)).collect(),
        }
    }
}

fn fit_point(tracks: &[PointTrack]) -> PointNoise {
    let bias = bias(tracks);
    let (mut clip_means, mut seen, mut hidden) = (Vec::new(), Vec::new(), Vec::new());
    for track in tracks {
        let rest: Vec<Option<[f64; 2]>> =
            track.errors.iter().map(|e| e.map(|(error, basis)| bias_fit::residual(error, &basis, &bias))).collect();
        let middle = [0, 1].map(|k| median(rest.iter().flatten().map(|e| e[k])).unwrap_or(0.0));
        if rest.iter().flatten().count() > 10 {
            clip_means.extend(middle);
        }
        let about: Vec<Option<[f64; 2]>> = rest.iter().map(|e| e.map(|e| [0, 1].map(|k| e[k] - middle[k]))).collect();
        for (state, into) in [(false, &mut seen), (true, &mut hidden)] {
            into.push(about.iter().zip(&track.hidden).map(|(e, h)| e.filter(|_| *h == state)).collect::<Vec<_>>());
        }
    }
    let occlusions = runs(tracks.iter().map(|track| track.hidden.iter().map(|h| Some(*h)).collect()));
    let gaps = runs(tracks.iter().map(|track| {
        track.errors.iter().zip(&track.inside).map(|(e, inside)| inside.then_some(e.is_none())).collect()
    }));
    PointNoise {
        bias,
        clip: deviation(&clip_means),
        visible: frame_noise(&seen),
        hidden: frame_noise(&hidden),
        occlusions,
        gaps,
    }
}

/// Weights of the bias over the frames in which the point is visible.
fn bias(tracks: &[PointTrack]) -> [f64; N_BASIS] {
    let seen = |track: &PointTrack| -> Vec<PointError> {
        track.errors.iter().zip(&track.hidden).filter_map(|(error, hidden)| error.filter(|_| !hidden)).collect()
    };
    bias_fit::weights(&[f64::INFINITY, 0.25, 0.25], || tracks.iter().flat_map(seen))
}

fn frame_noise(tracks: &[Vec<Option<[f64; 2]>>]) -> FrameNoise {
    let all: Vec<f64> = tracks.iter().flatten().flatten().flatten().copied().collect();
    let std = deviation(&all);
    let outliers: Vec<f64> = all.iter().copied().filter(|v| v.abs() > OUTLIER_STDS * std).collect();
    let (mut product, mut square) = (0.0, 0.0);
    for pair in tracks.iter().flat_map(|track| track.windows(2)) {
        let (Some(a), Some(b)) = (pair[0], pair[1]) else { continue };
        for k in 0..2 {
            if a[k].abs().max(b[k].abs()) <= OUTLIER_STDS * std {
                product += a[k] * b[k];
                square += (a[k] * a[k] + b[k] * b[k]) / 2.0;
            }
        }
    }
    let outlier_std = Ordered::new(outliers.iter().map(|v| v.abs())).quantile(0.68).unwrap_or(0.0);
    FrameNoise {
        deviation: std,
        outlier_std,
        outlier_share: outliers.len() as f64 / (all.len() as f64).max(1.0),
        correlation: if square > 0.0 { (product / square).clamp(0.0, 0.99) } else { 0.0 },
    }
}

/// Rates at which runs of `true` begin and end; `None` frames are left out.
fn runs(tracks: impl Iterator<Item = Vec<Option<bool>>>) -> Runs {
    let [mut outside, mut begun, mut inside, mut ended] = [0.0; 4];
    for track in tracks {
        for pair in track.windows(2) {
            match (pair[0], pair[1]) {
                (Some(false), Some(next)) => (outside, begun) = (outside + 1.0, begun + f64::from(u8::from(next))),
                (Some(true), Some(next)) => (inside, ended) = (inside + 1.0, ended + f64::from(u8::from(!next))),
                _ => (),
            }
        }
    }
    let rate = |part: f64, whole: f64, default: f64| if whole > 0.0 { part / whole } else { default };
    Runs { begin: rate(begun, outside, 0.0), end: rate(ended, inside, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::people::clips::tests::exact;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_fit_recovers_known_noise() {
        let mut known = KeypointNoise { set: "known".to_owned(), points: Default::default() };
        known.points[3] = PointNoise {
            bias: [0.08, 0.0, 0.0, 0.0],
            clip: 0.02,
            visible: FrameNoise { deviation: 0.01, correlation: 0.6, ..FrameNoise::default() },
            gaps: Runs { begin: 0.05, end: 0.3 },
            ..PointNoise::default()
        };
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let clips: Vec<RenderedClip> = (0..150)
            .map(|_| {
                let mut clip = exact();
                let frame = |t: usize| COCO.map(|c| Some([0, 1].map(|k| clip.truth.body[[t, c, k]])));
                let mut body: Vec<BodyPoints> = (0..clip.n_frames()).map(frame).collect();
                known.apply(&mut body, f64::from(clip.shoulders_px(0)), 1.0, true, &mut rng);
                for (t, frame) in body.iter().enumerate() {
                    for (point, coco) in COCO.into_iter().enumerate() {
                        let [x, y] = frame[point].unwrap_or_default();
                        clip.keypoints.body[[t, coco, 0]] = x;
                        clip.keypoints.body[[t, coco, 1]] = y;
                        clip.keypoints.body[[t, coco, 2]] = f32::from(u8::from(frame[point].is_some()));
                    }
                }
                clip
            })
            .collect();
        let found = fit("found", &clips).points[3].clone();
        let near = |a: f64, b: f64, off: f64| assert!((a - b).abs() < off, "{a} {b}: {found:?}");
        // A single pose does not determine the weights, only their sum.
        let frame: BodyPoints = COCO.map(|c| Some([0, 1].map(|k| exact().truth.body[[3, c, k]])));
        let vectors = basis(&frame, 3, f64::from(exact().shoulders_px(3))).unwrap();
        let along = |bias| bias_fit::residual([0.0; 2], &vectors, bias);
        (0..2).for_each(|k| near(along(&found.bias)[k], along(&known.points[3].bias)[k], 0.01));
        near(found.clip, 0.02, 0.005);
        near(found.visible.deviation, 0.01, 0.002);
        near(found.gaps.begin, 0.05, 0.01);
        near(found.gaps.end, 0.3, 0.04);
        assert!(found.visible.correlation > 0.4, "{found:?}");
    }
}
