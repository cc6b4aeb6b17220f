//! Perceived loudness of speech: integrated loudness of one channel by ITU-R BS.1770-4 (EBU R 128), in LUFS.

use crate::types::sound::Sound;
use ebur128::{EbuR128, Mode};

/// Measures the integrated loudness in LUFS; `None` for a sound that is silent throughout. A sound shorter than one
/// block of 0.4 s is measured as one block.
pub fn integrated(sound: &Sound) -> Option<f64> {
    let block = 4 * ((sound.rate as usize + 5) / 10);
    let n = sound.samples.len();
    let mut meter = EbuR128::new(1, sound.rate, Mode::I).ok()?;
    meter.add_frames_f32(&sound.samples).ok()?;
    meter.add_frames_f32(&vec![0.0; block.saturating_sub(n)]).ok()?;
    // Compensates for the zeros that pad a short sound.
    let share = n as f64 / n.max(block) as f64;
    let lufs = meter.loudness_global().ok()? - 10.0 * share.log10();
    lufs.is_finite().then_some(lufs)
}
