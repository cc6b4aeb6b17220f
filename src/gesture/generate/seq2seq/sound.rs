//! What a network hears: cepstra of each pose, with silence around the sound.

use ndarray::Array2;
use orator_base::audio::mfcc::{self, N_CEPSTRA};
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;

/// Lowest and highest rate of a sound, samples a second.
pub const RATES: std::ops::RangeInclusive<u32> = 8_000..=48_000;

/// Cepstra of `n_frames` poses of a sound, filled up with silence to `n_padded`, and half a context of silence on either
/// side: [n_padded + context - 1, 26].
pub fn features(sound: &Sound, fps: FrameRate, n_frames: usize, n_padded: usize, context: usize) -> Array2<f32> {
    let silence = mfcc::silence(sound.rate);
    let heard = mfcc::of_poses(&sound.samples, sound.rate, fps.per_sec(), n_frames);
    let at = |(t, c): (usize, usize)| if t < n_frames { heard[[t, c]] } else { silence[c] };
    mfcc::with_context(&Array2::from_shape_fn((n_padded, N_CEPSTRA), at), context, &silence)
}
