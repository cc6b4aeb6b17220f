//! Synchronisation of sound and frames: the samples of sound that belong to a frame. Frame `n` begins at `n / fps` seconds;
//! sample counts are never derived from frame counts in any other place.

use super::time::FrameRate;
use std::ops::Range;

/// The sample at which frame `frame_idx` begins: `round(frame_idx / fps * rate)`, halves upwards, in whole numbers.
pub fn sample_at(fps: FrameRate, rate: u32, frame_idx: usize) -> usize {
    let (num, den) = (u128::from(fps.num.max(1)), u128::from(fps.den));
    ((2 * frame_idx as u128 * den * u128::from(rate) + num) / (2 * num)) as usize
}

/// The samples of `frames`; neighbouring ranges of frames have neighbouring ranges of samples.
pub fn samples_of(fps: FrameRate, rate: u32, frames: Range<usize>) -> Range<usize> {
    sample_at(fps, rate, frames.start)..sample_at(fps, rate, frames.end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sound_and_frames_meet_by_time() {
        let fps = FrameRate::new(15, 1);
        assert_eq!(samples_of(fps, 16_000, 0..15), 0..16_000);
        assert_eq!(sample_at(fps, 16_000, 1), 1_067);
        let ntsc = FrameRate::new(15_000, 1_001);
        for frame in 0..2_000 {
            let exact = ntsc.secs(frame) * 16_000.0;
            assert!((sample_at(ntsc, 16_000, frame) as f64 - exact).abs() <= 0.5 + 1e-6);
        }
        assert_eq!(sample_at(fps, 16_000, 15 * 3_600 * 24), 16_000 * 3_600 * 24);
    }
}
