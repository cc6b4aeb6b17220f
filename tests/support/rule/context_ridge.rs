//! Ridge regressions from the audio around a frame to its pose and to its wrist speeds.

use super::ridge::{Ridge, RidgeSums};
use super::rule::wrist_speeds;
use ndarray::{Array2, Array3, s};
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;

/// Candidate ridge penalties; the validation set selects one.
const STRENGTHS: [f64; 8] = [1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0];

/// Audio features [T, 64] and joints [T, 49, 3] of a clip.
pub struct TrainingClip {
    pub sound: Array2<f64>,
    pub joints: Array3<f32>,
}

/// Audio context of a regression: the frame itself, and the numbers of frames before and after it.
#[derive(Clone, Copy, Debug)]
pub struct AudioContext {
    pub before: usize,
    pub after: usize,
}

/// Both fitted regressions.
pub struct ContextRidge {
    context: AudioContext,
    /// Regression to the speeds of both wrists, m/s.
    speed: Ridge,
    /// Regression to the 147 joint coordinates, metres.
    pose: Ridge,
    /// Selected penalties: of the speeds, of the pose.
    pub strengths: [f64; 2],
}

impl ContextRidge {
    /// Fits to `train`; `validation` selects the penalties.
    pub fn fit(context: AudioContext, train: &[TrainingClip], validation: &[TrainingClip], fps: FrameRate) -> Self {
        let n_inputs = train.first().map_or(0, |clip| clip.sound.ncols()) * (context.before + 1 + context.after);
        let mut sums = [RidgeSums::new(n_inputs, 2), RidgeSums::new(n_inputs, 3 * N_JOINTS)];
        for clip in train {
            let (inputs, targets) = (context.inputs(&clip.sound), targets(clip, fps));
            let inputs = inputs.slice(s![..targets[0].nrows(), ..]);
            sums.iter_mut().zip(&targets).for_each(|(sums, target)| sums.add(inputs, target.view()));
        }
        let held_out: Vec<(Array2<f64>, [Array2<f64>; 2])> =
            validation.iter().map(|clip| (context.inputs(&clip.sound), targets(clip, fps))).collect();
        let best = |which: usize| {
            let error = |ridge: &Ridge| -> f64 {
                let of = |(inputs, targets): &(Array2<f64>, [Array2<f64>; 2])| {
                    let inputs = inputs.slice(s![..targets[which].nrows(), ..]);
                    (ridge.predict(inputs) - &targets[which]).mapv(|e| e * e).sum()
                };
                held_out.iter().map(of).sum()
            };
            let tried = STRENGTHS.map(|strength| {
                let ridge = sums[which].ridge(strength);
                (error(&ridge), strength, ridge)
            });
            tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let of = |which: usize| {
            best(which).map_or_else(|| (0.0, sums[which].ridge(1.0)), |(_, strength, ridge)| (strength, ridge))
        };
        let (speed, pose) = (of(0), of(1));
        Self { context, strengths: [speed.0, pose.0], speed: speed.1, pose: pose.1 }
    }

    /// Predicts the speeds of both wrists, [T - 1, 2], m/s, from audio features [T, n].
    pub fn speeds(&self, sound: &Array2<f64>) -> Array2<f64> {
        self.speed.predict(self.context.inputs(sound).slice(s![..sound.nrows().saturating_sub(1), ..]))
    }

    /// Predicts the joints [T, 49, 3] from audio features [T, n].
    pub fn poses(&self, sound: &Array2<f64>) -> Array3<f32> {
        let values = self.pose.predict(self.context.inputs(sound).view());
        Array3::from_shape_fn((sound.nrows(), N_JOINTS, 3), |(t, joint, k)| values[[t, 3 * joint + k]] as f32)
    }
}

impl AudioContext {
    /// Audio features [T, n] concatenated with those of the context; edge frames are repeated beyond the ends.
    fn inputs(self, sound: &Array2<f64>) -> Array2<f64> {
        let (n_frames, n) = sound.dim();
        let last = n_frames.saturating_sub(1);
        Array2::from_shape_fn((n_frames, n * (self.before + 1 + self.after)), |(t, i)| {
            let frame = (t + i / n).saturating_sub(self.before).min(last);
            sound[[frame, i % n]]
        })
    }
}

/// Wrist speeds [T - 1, 2] and coordinates [T - 1, 147].
fn targets(clip: &TrainingClip, fps: FrameRate) -> [Array2<f64>; 2] {
    let n = clip.joints.shape()[0].saturating_sub(1);
    let pose = Array2::from_shape_fn((n, 3 * N_JOINTS), |(t, i)| f64::from(clip.joints[[t, i / 3, i % 3]]));
    [wrist_speeds(clip.joints.view(), fps), pose]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Motion that repeats the audio of four frames earlier is predicted only with enough context.
    #[test]
    fn earlier_audio_within_the_context_is_used() {
        let fps = FrameRate::new(15, 1);
        let clip = |seed: usize| {
            let sound = Array2::from_shape_fn((300, 2), |(t, k)| ((t * t * (7 + k) + seed * 31) as f64 * 0.37).sin());
            let delayed = |t: usize| sound[[t.saturating_sub(4), 0]] as f32;
            let joints = Array3::from_shape_fn((300, N_JOINTS, 3), |(t, _, k)| if k == 0 { delayed(t) } else { 0.0 });
            TrainingClip { sound, joints }
        };
        let (train, validation, test) = ([clip(1), clip(2)], [clip(3)], clip(4));
        let error = |before: usize| {
            let context = AudioContext { before, after: 1 };
            let ridge_model = ContextRidge::fit(context, &train, &validation, fps);
            let difference = ridge_model.poses(&test.sound) - &test.joints;
            difference.iter().map(|e| e.abs()).sum::<f32>() / difference.len() as f32
        };
        assert!(error(5) < 0.01 && error(2) > 0.1, "{} {}", error(5), error(2));
    }
}
