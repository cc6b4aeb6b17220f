//! Errors of the head angles that `animate` computes from the face keypoints, degrees.

use super::clips::RenderedClip;
use super::points::share;
use orator_base::math::order::median;
use orator_base::motion::face;
use serde::Serialize;

/// Mean absolute errors in degrees. The median pitch of a clip is subtracted, in the truth as well.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HeadErrors {
    pub yaw: f64,
    pub pitch: f64,
    pub roll: f64,
    /// Share of the frames with an angle, 0..1.
    pub found: f64,
}

impl HeadErrors {
    /// Means over clips.
    pub fn measure(clips: &[&RenderedClip]) -> Self {
        let (mut sums, mut n_found, mut n_frames) = ([0.0; 3], 0, 0);
        for clip in clips {
            let n = clip.n_frames();
            let found = face::angles(clip.keypoints.body.view());
            let truth = |t: usize| [0, 1, 2].map(|k| f64::from(clip.truth.head[[t, k]]));
            let seen = || (0..n).filter(|&t| found.get(t).is_some_and(Option::is_some));
            let level = median(seen().map(|t| truth(t)[1])).unwrap_or(0.0);
            n_frames += n;
            for t in seen() {
                let Some([yaw, down, right]) = found[t].map(|angles| angles.map(f64::to_degrees)) else { continue };
                let [true_yaw, true_pitch, true_roll] = truth(t);
                let errors = [yaw - true_yaw, -down - (true_pitch - level), -right - true_roll];
                sums.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error.abs());
                n_found += 1;
            }
        }
        let [yaw, pitch, roll] = sums.map(|sum| if n_found == 0 { f64::NAN } else { sum / n_found as f64 });
        Self { yaw, pitch, roll, found: share(n_found, n_frames) }
    }
}
