//! The body lifter: a temporal-convolution network with its normalisation, from keypoints over time to poses over time.

use super::temporal::{Config, TemporalLifter};
use crate::Mode;
use crate::params::Params;
use candle_core::{Result, Tensor};
use orator_base::motion::upper_body::{BodyPoints, HandDirections, Pose};
use orator_base::motion::view::body::{BodyView, N_IN, N_OUT, mirror_mean};

/// Number of windows per forward pass.
const BATCH: usize = 256;
/// Prefix of the network's tensors.
const NAME: &str = "body";

/// Network that maps a window of keypoints to the pose of its middle frame.
pub struct BodyLifter {
    pub net: TemporalLifter,
}

impl BodyLifter {
    /// Configuration for this number of channels and kernel widths, whose product is the number of frames of a window.
    pub fn config(channels: usize, widths: &[usize]) -> Config {
        Config { n_in: N_IN, n_out: N_OUT, channels, widths: widths.to_vec(), dropout: 0.0 }
    }

    /// Creates the network's tensors in `params`.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        Ok(Self { net: TemporalLifter::new(params, NAME, config)? })
    }

    /// Returns a pose for every frame, in px of the picture with the neck at 0; `None` where a shoulder is not visible
    /// within half a window. The first and last frame are repeated beyond the ends. The frames of a window are `step`
    /// frames apart, because the network is trained at 15 frames per second. `hands` has the directions of the hands in
    /// every frame, or is empty. The result is averaged with that of the mirrored window.
    pub fn poses(&self, seen: &[BodyPoints], hands: &[HandDirections], step: f64) -> Result<Vec<Option<Pose>>> {
        let window = self.net.config().receptive_field();
        let view = |t: usize| BodyView::around(seen, hands, t, window, step);
        let mut poses = Vec::with_capacity(seen.len());
        for first in (0..seen.len()).step_by(BATCH) {
            let views: Vec<Option<BodyView>> = (first..seen.len().min(first + BATCH)).map(view).collect();
            let visible: Vec<&BodyView> = views.iter().flatten().collect();
            let mirrored: Vec<BodyView> = visible.iter().map(|view| view.mirrored()).collect();
            let outputs = self.outputs(visible.iter().copied().chain(&mirrored))?;
            let (own, other) = outputs.split_at(outputs.len() / 2);
            let mut outputs = own.chunks_exact(N_OUT).zip(other.chunks_exact(N_OUT)).map(|(a, b)| mirror_mean(a, b));
            poses.extend(views.iter().map(|view| Some(view.as_ref()?.pose(&outputs.next()?))));
        }
        Ok(poses)
    }

    /// Returns N_OUT values per view.
    fn outputs<'a>(&self, views: impl Iterator<Item = &'a BodyView>) -> Result<Vec<f32>> {
        let (n_in, window) = (self.net.config().n_in, self.net.config().receptive_field());
        let numbers: Vec<f32> = views.flat_map(|view| view.numbers.iter().take(n_in * window).copied()).collect();
        let n_views = numbers.len() / (n_in * window);
        if n_views == 0 {
            return Ok(Vec::new());
        }
        let x = Tensor::from_vec(numbers, (n_views, n_in, window), self.net.device())?;
        self.net.forward(&x, &mut Mode::Eval)?.flatten_all()?.to_vec1::<f32>()
    }
}
