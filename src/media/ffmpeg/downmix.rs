//! Mix of a run's channels to mono. Where the two channels of stereo have opposite phase, their mean would be near
//! silence, so the louder one is used: decided for blocks of half a second, with hysteresis; changes are cross-faded.

use super::resample::{Resampler, SoundFormat};
use anyhow::{Result, ensure};
use ffmpeg_next::{ChannelLayout, frame};

/// Blocks per second, and fades per second.
const BLOCKS_PER_SEC: usize = 2;
const FADES_PER_SEC: usize = 100;
/// Power of the mix relative to the mean power of the channels: below the first, a single channel is used (their
/// correlation is below -0.9 at equal levels); above the second, the mix is used again.
const MIN_MIX: f64 = 0.05;
const MIN_MIX_AGAIN: f64 = 0.15;
/// Mean power of the channels below which a block changes nothing: -60 dB of full scale.
const MIN_POWER: f64 = 1e-6;

/// Mono mix of one continuous run of one format, at another rate.
pub(crate) struct Downmix {
    mix: Resampler,
    stereo: Option<([Resampler; 2], ChannelChoice)>,
}

impl Downmix {
    pub(crate) fn new(format: SoundFormat, rate: u32) -> Result<Self> {
        let channel = || Resampler::new(SoundFormat { layout: ChannelLayout::MONO, ..format }, rate);
        let is_stereo = format.layout.channels() == 2;
        let stereo = is_stereo.then(|| anyhow::Ok(([channel()?, channel()?], ChannelChoice::new(rate)))).transpose()?;
        Ok(Self { mix: Resampler::new(format, rate)?, stereo })
    }

    pub(crate) fn format(&self) -> SoundFormat {
        self.mix.format()
    }

    /// Duration of the input after compensation, seconds.
    pub(crate) fn secs(&self) -> f64 {
        self.mix.secs()
    }

    /// Whether no compensation is active.
    pub(crate) fn is_uncompensated(&self) -> bool {
        self.mix.is_uncompensated()
    }

    /// Makes the next `over_secs` seconds longer by `secs` (shorter if negative).
    pub(crate) fn compensate_drift(&mut self, secs: f64, over_secs: f64) -> Result<()> {
        let channels = self.stereo.iter_mut().flat_map(|(channels, _)| channels);
        std::iter::once(&mut self.mix).chain(channels).try_for_each(|one| one.compensate_drift(secs, over_secs))
    }

    /// Converts a frame of this mix's format and appends the samples that are ready to `out`.
    pub(crate) fn push(&mut self, frame: &frame::Audio, out: &mut Vec<f32>) -> Result<()> {
        let Some((channels, choice)) = &mut self.stereo else { return self.mix.push(frame, out) };
        let [mix, pending @ ..] = &mut choice.pending;
        self.mix.push(frame, mix)?;
        for (nth, (channel, pending)) in channels.iter_mut().zip(pending).enumerate() {
            channel.push(&one_channel(frame, nth)?, pending)?;
        }
        choice.deliver(out);
        Ok(())
    }

    /// Appends the remaining samples, so that input and output have equal duration. Returns the number of samples of
    /// the run that are those of a single channel.
    pub(crate) fn finish(self, out: &mut Vec<f32>) -> Result<u64> {
        let Some((channels, mut choice)) = self.stereo else { return self.mix.finish(out).map(|()| 0) };
        let [mix, pending @ ..] = &mut choice.pending;
        self.mix.finish(mix)?;
        channels.into_iter().zip(pending).try_for_each(|(channel, pending)| channel.finish(pending))?;
        choice.deliver(out);
        choice.block(choice.n_pending(), out);
        Ok(choice.n_single)
    }
}

/// Channel `channel` of a stereo frame.
fn one_channel(frame: &frame::Audio, channel: usize) -> Result<frame::Audio> {
    let (n_samples, n_bytes) = (frame.samples(), frame.format().bytes());
    let mut mono = frame::Audio::new(frame.format(), n_samples, ChannelLayout::MONO);
    ensure!(mono.planes() == 1, "out of memory for an audio frame");
    mono.set_rate(frame.rate());
    let (plane, step, first) =
        if frame.is_planar() { (channel, n_bytes, 0) } else { (0, 2 * n_bytes, channel * n_bytes) };
    // SAFETY: the extended_data of both frames holds a pointer for each plane: in `frame` to `n_samples` values of
    // `step` bytes, of which the channel begins at `first`; in `mono` to as many values of `n_bytes`.
    unsafe {
        let from = *(*frame.as_ptr()).extended_data.add(plane);
        let to = *(*mono.as_mut_ptr()).extended_data;
        for nth in 0..n_samples {
            std::ptr::copy_nonoverlapping(from.add(nth * step + first), to.add(nth * n_bytes), n_bytes);
        }
    }
    Ok(mono)
}

/// Choice between the mix and the two channels, block by block.
struct ChannelChoice {
    rate: usize,
    /// Samples that are not decided yet: the mix and the two channels.
    pending: [Vec<f32>; 3],
    /// What the last block used, as an index of `pending`; `None` before the first block.
    used: Option<usize>,
    n_single: u64,
}

impl ChannelChoice {
    fn new(rate: u32) -> Self {
        Self { rate: rate as usize, pending: [const { Vec::new() }; 3], used: None, n_single: 0 }
    }

    fn n_pending(&self) -> usize {
        self.pending.iter().map(Vec::len).min().unwrap_or(0)
    }

    /// Appends all complete blocks to `out`.
    fn deliver(&mut self, out: &mut Vec<f32>) {
        let n_block = (self.rate / BLOCKS_PER_SEC).max(1);
        while self.n_pending() >= n_block {
            self.block(n_block, out);
        }
    }

    /// Appends a block of `n` samples to `out`.
    fn block(&mut self, n: usize, out: &mut Vec<f32>) {
        let power = |samples: &Vec<f32>| {
            samples[..n].iter().map(|sample| f64::from(*sample).powi(2)).sum::<f64>() / n.max(1) as f64
        };
        let [mix, left, right] = self.pending.each_ref().map(power);
        let both = f64::midpoint(left, right);
        let before = self.used.unwrap_or(0);
        let used = match before {
            _ if both < MIN_POWER => before,
            0 if mix < MIN_MIX * both => {
                if right > left {
                    2
                } else {
                    1
                }
            }
            channel if mix < MIN_MIX_AGAIN * both => channel,
            _ => 0,
        };
        let n_fade = if used == before || self.used.is_none() { 0 } else { n.min(self.rate / FADES_PER_SEC) };
        let (from, to) = (&self.pending[before][..n_fade], &self.pending[used]);
        let fade = |(nth, (from, to)): (usize, (&f32, &f32))| from + (to - from) * (nth as f32 + 0.5) / n_fade as f32;
        out.extend(from.iter().zip(to).enumerate().map(fade));
        out.extend_from_slice(&to[n_fade..n]);
        self.pending.iter_mut().for_each(|samples| drop(samples.drain(..n)));
        self.used = Some(used);
        self.n_single += if used == 0 { 0 } else { n as u64 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: u32 = 16_000;

    /// Passes a signal through the choice, in pieces; `right` returns the right channel of the left one at a time.
    fn chosen(secs: f64, amplitude: f32, right: impl Fn(f64, f32) -> f32) -> (Vec<f32>, Vec<f32>, u64) {
        let mut choice = ChannelChoice::new(RATE);
        let (mut out, mut all_left) = (Vec::new(), Vec::new());
        for n in 0..(secs * f64::from(RATE)) as usize {
            let left = amplitude * (n as f32 * 0.3).sin();
            let right = right(n as f64 / f64::from(RATE), left);
            let values = [f32::midpoint(left, right), left, right];
            choice.pending.iter_mut().zip(values).for_each(|(samples, value)| samples.push(value));
            all_left.push(left);
            if n % 1000 == 999 {
                choice.deliver(&mut out);
            }
        }
        choice.deliver(&mut out);
        choice.block(choice.n_pending(), &mut out);
        (out, all_left, choice.n_single)
    }

    #[test]
    fn the_mix_is_unchanged_unless_the_channels_cancel_out() {
        for gain in [1.0, 0.3, 0.0, -0.3] {
            let (out, left, n_single) = chosen(2.3, 0.5, |_, left| gain * left);
            let expected: Vec<f32> = left.iter().map(|left| f32::midpoint(*left, gain * left)).collect();
            assert_eq!((out == expected, n_single), (true, 0), "gain {gain}");
        }
        // Noise of opposite phase in silence changes nothing.
        assert_eq!(chosen(2.0, 0.0005, |_, left| -left).2, 0);
    }

    #[test]
    fn changes_of_phase_are_cross_faded() {
        // The right channel changes its sign gradually, around 2 s and 4 s.
        let gain = |secs: f64| (10.0 * (secs - 3.0).abs() - 10.0).clamp(-1.0, 1.0) as f32;
        let (out, left, n_single) = chosen(6.0, 0.5, |secs, left| gain(secs) * left);
        assert_eq!((out.len(), n_single), (left.len(), 32_000));
        let steps = out.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        assert!(steps.fold(0.0, f32::max) < 0.16, "clicks");
        let quiet = out.chunks(1600).filter(|piece| piece.iter().all(|sample| sample.abs() < 0.2)).count();
        assert_eq!(quiet, 0);
    }
}
