//! Audio of a file as mono at one rate, on the clock of its images: sample k is at k / rate seconds after the first
//! image. Earlier audio is cut; a late start and gaps in the container become silence. A file without images starts
//! with its first sample. Audio more than ten minutes after the previous audio, or beyond a day, is dropped as damaged.

use super::decode::StreamDecoder;
use super::downmix::Downmix;
use super::origin;
use super::resample::{Resampler, SoundFormat, first_not_finite, format_of};
use super::source::{self, MAX_GAP_SECS, MAX_SECS, UnreadableMedia};
use anyhow::{Context, Result, bail};
use ffmpeg_next::format::{Sample, sample};
use ffmpeg_next::{ChannelLayout, frame};
use orator_base::types::sound::{AudioTracks, SAMPLE_RATE, Sound, opposite_phase_note};
use std::path::Path;

/// Difference between timestamp and sample count that counts as a gap, seconds: less than a lost frame of any codec,
/// more than the rounding of any container.
const GAP_SECS: f64 = 0.015;
/// Drift of the timestamps relative to the sample count, for instance from a slow clock, is followed: if the mean
/// difference over `MEAN_SECS` exceeds `ROUNDING_SECS`, the rounding of containers, the next `CORRECTION_SECS` are
/// lengthened or shortened by it.
const MEAN_SECS: f64 = 1.0;
const ROUNDING_SECS: f64 = 0.0005;
const CORRECTION_SECS: f64 = 1.0;
/// Number of samples resampled at once.
const CHUNK: usize = 65_536;

/// All audio of `path` (wav, flac, mp3, a video, ...) as mono at `rate` samples per second; `None` if it has no audio.
pub fn read_mono(path: &Path, rate: u32) -> Result<Option<Sound>> {
    Ok(read_mono_with_note(path, rate)?.map(|(sound, _)| sound))
}

/// [`read_mono`], with a note on the mix, if any.
pub fn read_mono_with_note(path: &Path, rate: u32) -> Result<Option<(Sound, Option<String>)>> {
    let mut samples = Vec::new();
    let streamed = stream_mono(path, 0, rate, &mut |chunk| {
        samples.extend_from_slice(chunk);
        Ok(())
    })?;
    Ok(streamed.map(|streamed| (Sound { rate, samples }, opposite_phase_note(streamed.opposite_phase_secs))))
}

/// Resamples a sound to `rate` with unchanged duration; frequencies above half the lower rate are removed.
pub fn at_rate(sound: &Sound, rate: u32) -> Result<Sound> {
    if sound.rate == rate {
        return Ok(sound.clone());
    }
    let sample = Sample::F32(sample::Type::Packed);
    let mut resampler = Resampler::new(SoundFormat { sample, layout: ChannelLayout::MONO, rate: sound.rate }, rate)?;
    let mut samples = Vec::new();
    for chunk in sound.samples.chunks(CHUNK) {
        let mut frame = frame::Audio::new(sample, chunk.len(), ChannelLayout::MONO);
        frame.set_rate(sound.rate);
        frame.plane_mut::<f32>(0).copy_from_slice(chunk);
        resampler.push(&frame, &mut samples)?;
    }
    resampler.finish(&mut samples)?;
    Ok(Sound { rate, samples })
}

/// All audio of `path` as mono at 16 kHz.
///
/// # Errors
///
/// [`UnreadableMedia`] if the file does not exist or has no audio that decodes.
pub fn read_sound(path: &Path) -> Result<Sound> {
    let name = path.display();
    let unreadable = |problem| Err(UnreadableMedia(problem).into());
    if !path.is_file() {
        return unreadable(format!("{name} is not a file"));
    }
    match read_mono(path, SAMPLE_RATE)? {
        Some(sound) if !sound.samples.is_empty() => Ok(sound),
        _ => unreadable(format!("{name} has no audio")),
    }
}

/// Summary of a [`stream_mono`] call.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamedSound {
    /// Length of the audio, seconds.
    pub secs: f64,
    /// The track that was read, and the available ones.
    pub tracks: AudioTracks,
    /// Note on audio that was dropped.
    pub damage: Option<String>,
    /// Seconds in which the two channels of stereo cancel out, so that the louder one replaces their mix.
    pub opposite_phase_secs: f64,
}

/// Decodes track `track` of `path` (from 1; 0: automatic) and passes it to `sink` in chunks; `None` without audio.
///
/// # Errors
///
/// The file or track cannot be read or decoded, or a sample is not finite; the message gives its time.
pub fn stream_mono(
    path: &Path,
    track: usize,
    rate: u32,
    sink: &mut dyn FnMut(&[f32]) -> Result<()>,
) -> Result<Option<StreamedSound>> {
    let input = source::open(path)?;
    let chosen = source::audio_track(&input, track).with_context(|| path.display().to_string())?;
    let Some((stream, tracks)) = chosen else { return Ok(None) };
    let stream_idx = stream.index();
    let latest_secs = source::latest_secs(&input, &stream);
    let mut zero_secs = origin::first_picture_secs(path)?;
    let mut decode = StreamDecoder::new(path, input, stream_idx, 1)?;
    let secs_per_tick = f64::from(decode.time_base());
    let mut timeline = SoundTimeline::new(rate, sink);
    let mut frame = frame::Audio::empty();
    let (mut n_frames, mut n_misplaced) = (0u64, 0u64);
    while decode.next(&mut frame)? {
        if frame.samples() == 0 || frame.rate() == 0 {
            continue;
        }
        source::check_rate(path, frame.rate())?;
        let at = frame.timestamp().map(|ticks| ticks as f64 * secs_per_tick);
        let zero = *zero_secs.get_or_insert(at.unwrap_or(0.0));
        // A time far beyond the stated end of the file is invalid; the audio continues without a gap.
        let is_joined = !decode.joins().is_empty();
        let at = at.map(|at| at - zero).filter(|at| *at < latest_secs || is_joined);
        if timeline.is_plausible_time(at) {
            n_frames += 1;
            if let Some(sample_idx) = first_not_finite(&frame) {
                let secs = at.unwrap_or(timeline.end_secs()) + sample_idx as f64 / f64::from(frame.rate());
                bail!(
                    "the audio of {} is damaged: a sample at {secs:.2} s is not finite; convert or record it again",
                    path.display()
                );
            }
            timeline.push(at, &frame).with_context(|| format!("cannot process the audio of {}", path.display()))?;
        } else {
            n_misplaced += 1;
        }
    }
    let damage = (n_misplaced > 0).then(|| format!("{n_misplaced} pieces of sound with impossible times"));
    if n_frames == 0 {
        let Some(damage) = damage.or_else(|| decode.damage()) else { return Ok(None) };
        let name = path.display();
        let problem = format!("no audio of {name} can be decoded ({damage}): copy or download it again");
        return Err(UnreadableMedia(problem).into());
    }
    timeline.end_run()?;
    let [secs, opposite_phase_secs] = [timeline.n_written, timeline.n_single].map(|n| n as f64 / f64::from(rate));
    Ok(Some(StreamedSound { secs, tracks, damage, opposite_phase_secs }))
}

/// Accumulated difference between timestamps and sample count.
#[derive(Default)]
struct ClockDrift {
    sum: f64,
    secs: f64,
}

impl ClockDrift {
    /// Adds a frame of `secs` whose timestamp is `drift` seconds late; returns the mean after each `MEAN_SECS`.
    fn mean(&mut self, drift: f64, secs: f64) -> Option<f64> {
        self.sum += drift * secs;
        self.secs += secs;
        let mean = (self.secs >= MEAN_SECS).then(|| self.sum / self.secs);
        if mean.is_some() {
            *self = Self::default();
        }
        mean
    }
}

/// Places continuous runs of audio on the timeline.
struct SoundTimeline<'a> {
    rate: u32,
    n_written: u64,
    /// Samples to skip at the start of the run, because they are before time 0 or already written.
    n_skip: u64,
    /// Current run, and its start time in seconds.
    run: Option<(Downmix, f64)>,
    /// Number of samples of a single channel.
    n_single: u64,
    drift: ClockDrift,
    ready: Vec<f32>,
    sink: &'a mut dyn FnMut(&[f32]) -> Result<()>,
}

impl<'a> SoundTimeline<'a> {
    fn new(rate: u32, sink: &'a mut dyn FnMut(&[f32]) -> Result<()>) -> Self {
        let (drift, ready) = (ClockDrift::default(), Vec::new());
        Self { rate, n_written: 0, n_skip: 0, run: None, n_single: 0, drift, ready, sink }
    }

    /// End time of the audio so far, seconds.
    fn end_secs(&self) -> f64 {
        let written = self.n_written as f64 / f64::from(self.rate);
        self.run.as_ref().map_or(written, |(run, start)| start + run.secs())
    }

    /// Whether audio at `at` seconds is close enough to the preceding audio and before the maximum length.
    fn is_plausible_time(&self, at: Option<f64>) -> bool {
        let end = self.end_secs();
        let at = at.unwrap_or(end);
        at - end.max(0.0) <= MAX_GAP_SECS && at < MAX_SECS
    }

    /// Adds a frame that starts at `at` seconds; without a time it continues where the preceding audio ended.
    fn push(&mut self, at: Option<f64>, frame: &frame::Audio) -> Result<()> {
        let format = format_of(frame);
        let end = self.end_secs();
        let at = at.unwrap_or(end);
        let continues = self.run.is_some() && (at - end).abs() <= GAP_SECS;
        if !continues || self.run.as_ref().is_none_or(|(run, _)| run.format() != format) {
            self.end_run()?;
            self.start_run(Downmix::new(format, self.rate)?, at)?;
        }
        if let Some((run, _)) = &mut self.run {
            if continues
                && run.is_uncompensated()
                && let Some(mean) = self.drift.mean(at - end, frame.samples() as f64 / f64::from(frame.rate()))
                && mean.abs() > ROUNDING_SECS
            {
                run.compensate_drift(mean, CORRECTION_SECS)?;
            }
            run.push(frame, &mut self.ready)?;
        }
        self.deliver()
    }

    fn start_run(&mut self, run: Downmix, at: f64) -> Result<()> {
        let start_sample = (at * f64::from(self.rate)).round() as i64;
        let delay = start_sample.saturating_sub(i64::try_from(self.n_written)?);
        self.n_skip = delay.min(0).unsigned_abs();
        self.run = Some((run, at));
        self.drift = ClockDrift::default();
        const SILENCE: [f32; 4096] = [0.0; 4096];
        let mut n_silent = delay.max(0) as u64;
        while n_silent > 0 {
            let n = n_silent.min(SILENCE.len() as u64);
            (self.sink)(&SILENCE[..n as usize])?;
            self.n_written += n;
            n_silent -= n;
        }
        Ok(())
    }

    fn end_run(&mut self) -> Result<()> {
        if let Some((run, _)) = self.run.take() {
            self.n_single += run.finish(&mut self.ready)?;
        }
        self.deliver()
    }

    fn deliver(&mut self) -> Result<()> {
        let n_skip = self.n_skip.min(self.ready.len() as u64);
        self.n_skip -= n_skip;
        let streamed = &self.ready[n_skip as usize..];
        if !streamed.is_empty() {
            (self.sink)(streamed)?;
            self.n_written += streamed.len() as u64;
        }
        self.ready.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_jumps_are_limited_to_ten_minutes_and_a_day() {
        let mut sink = |_: &[f32]| Ok(());
        let mut timeline = SoundTimeline { n_written: 50, ..SoundTimeline::new(10, &mut sink) };
        let is_plausible_time = |timeline: &SoundTimeline| {
            [None, Some(-1e12), Some(604.0), Some(606.0)].map(|at| timeline.is_plausible_time(at))
        };
        assert_eq!(is_plausible_time(&timeline), [true, true, true, false]);
        timeline.n_written = 864_000;
        assert_eq!(is_plausible_time(&timeline), [false, true, true, true]);
        assert!(!timeline.is_plausible_time(Some(f64::NAN)));
    }
}
