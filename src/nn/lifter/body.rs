//! The body lifter: the temporal-convolution network with the views it was trained on, from keypoints over time to
//! poses over time.

use super::temporal::{Config, TemporalLifter};
use crate::Mode;
use crate::params::Params;
use candle_core::{Device, Result, Tensor};
use orator_base::motion::upper_body::{Pose, SeenBody};
use orator_base::motion::view::body::{BodyView, N_IN, N_OUT, mirror_mean};

/// Windows that go through the network together.
const BATCH: usize = 256;
/// Prefix of the network's tensors.
const NAME: &str = "body";

/// The network that turns a window of keypoints into the pose of its middle frame.
pub struct BodyLifter {
    pub net: TemporalLifter,
}

impl BodyLifter {
    /// The network's shape for this many channels and these kernel widths, whose product is the window's frames.
    pub fn config(channels: usize, widths: &[usize]) -> Config {
        Config { n_in: N_IN, n_out: N_OUT, channels, widths: widths.to_vec(), dropout: 0.0 }
    }

    /// Makes the network's tensors in `params`.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        Ok(Self { net: TemporalLifter::new(params, NAME, config)? })
    }

    /// A pose for every frame, in px of the picture, the neck at 0: `None` where a shoulder is not seen within half a
    /// window. Before the first and after the last frame the body stands still. The frames of a window
    /// lie `step` frames apart: the network knows motion at 15 frames a second. Each window is looked at in the mirror
    /// as well.
    pub fn poses(&self, seen: &[SeenBody], step: f64) -> Result<Vec<Option<Pose>>> {
        let window = self.net.config().receptive_field();
        let view = |t: usize| BodyView::around(seen, t, window, step);
        let mut poses = Vec::with_capacity(seen.len());
        for first in (0..seen.len()).step_by(BATCH) {
            let views: Vec<Option<BodyView>> = (first..seen.len().min(first + BATCH)).map(view).collect();
            let there: Vec<&BodyView> = views.iter().flatten().collect();
            let mirrored: Vec<BodyView> = there.iter().map(|view| view.mirrored()).collect();
            let outputs = self.outputs(there.iter().copied().chain(&mirrored))?;
            let (own, other) = outputs.split_at(outputs.len() / 2);
            let mut outputs = own.chunks_exact(N_OUT).zip(other.chunks_exact(N_OUT)).map(|(a, b)| mirror_mean(a, b));
            poses.extend(views.iter().map(|view| Some(view.as_ref()?.pose(&outputs.next()?))));
        }
        Ok(poses)
    }

    /// N_OUT numbers a view.
    fn outputs<'a>(&self, views: impl Iterator<Item = &'a BodyView>) -> Result<Vec<f32>> {
        let numbers: Vec<f32> = views.flat_map(|view| view.numbers.iter().copied()).collect();
        let window = self.net.config().receptive_field();
        let n_views = numbers.len() / (N_IN * window);
        if n_views == 0 {
            return Ok(Vec::new());
        }
        let x = Tensor::from_vec(numbers, (n_views, N_IN, window), &Device::Cpu)?;
        self.net.forward(&x, &mut Mode::Eval)?.flatten_all()?.to_vec1::<f32>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_gets_a_pose_and_none_where_nobody_is() -> anyhow::Result<()> {
        let mut params = Params::new(1);
        let lifter = BodyLifter::new(&mut params, &BodyLifter::config(16, &[3, 3, 3]))?;
        let seen: SeenBody = std::array::from_fn(|j| Some([j as f32 * 10.0, (j * j) as f32]));
        let mut frames = vec![seen; 300];
        frames[100..200].fill([None; 9]);
        let poses = lifter.poses(&frames, 1.0)?;
        assert_eq!(poses.len(), 300);
        for (t, pose) in poses.iter().enumerate() {
            assert_eq!(pose.is_none(), (113..187).contains(&t), "frame {t}");
        }
        assert!(lifter.poses(&[], 2.0)?.is_empty());
        Ok(())
    }
}
