//! Conversion of decoded audio to mono f32 at one rate with swresample. A `Resampler` handles one run of one format.

use anyhow::{Context, Result, ensure};
use ffmpeg_next as ffmpeg;
use ffmpeg_next::format::{Sample, sample};
use ffmpeg_next::software::resampling;
use ffmpeg_next::{ChannelLayout, Dictionary, frame};

#[derive(Clone, Copy, PartialEq)]
pub(crate) struct SoundFormat {
    pub sample: Sample,
    pub layout: ChannelLayout,
    /// Samples per second.
    pub rate: u32,
}

/// The format of `frame`; an unspecified channel layout is replaced by the default one for the number of channels.
pub(crate) fn format_of(frame: &frame::Audio) -> SoundFormat {
    let named = frame.channel_layout();
    let layout = if named.is_empty() { ChannelLayout::default(i32::from(frame.channels())) } else { named };
    SoundFormat { sample: frame.format(), layout, rate: frame.rate() }
}

/// Index of the first sample of `frame` that is NaN or infinite in any channel; it would make all derived values NaN.
pub(crate) fn first_not_finite(frame: &frame::Audio) -> Option<usize> {
    let (n_samples, n_channels) = (frame.samples(), usize::from(frame.channels()));
    let (n_planes, n_each) = match frame.format() {
        Sample::F32(sample::Type::Planar) | Sample::F64(sample::Type::Planar) => (n_channels, 1),
        Sample::F32(sample::Type::Packed) | Sample::F64(sample::Type::Packed) => (1, n_channels),
        _ => return None,
    };
    let is_double = matches!(frame.format(), Sample::F64(_));
    let n_values = n_samples * n_each;
    #[allow(clippy::cast_ptr_alignment)] // ffmpeg aligns its planes
    let first = |plane: usize| {
        // SAFETY: the extended_data of a frame holds a pointer per plane, each to `n_values` values of its format.
        let value = unsafe {
            let values = *(*frame.as_ptr()).extended_data.add(plane);
            if is_double {
                std::slice::from_raw_parts(values.cast::<f64>(), n_values).iter().position(|v| !v.is_finite())
            } else {
                std::slice::from_raw_parts(values.cast::<f32>(), n_values).iter().position(|v| !v.is_finite())
            }
        };
        value.map(|at| at / n_each)
    };
    (0..n_planes).filter_map(first).min()
}

/// Resampler of one continuous run to mono f32.
pub(crate) struct Resampler {
    context: resampling::Context,
    format: SoundFormat,
    rate: u32,
    n_in: u64,
    n_out: u64,
    /// Number of samples added (negative: removed) to compensate drift, and the input count at which the last ends.
    n_compensated: i64,
    compensation_end: u64,
}

impl Resampler {
    pub(crate) fn new(format: SoundFormat, rate: u32) -> Result<Self> {
        let SoundFormat { sample, layout, rate: source_rate } = format;
        ensure!(source_rate > 0 && rate > 0, "cannot resample audio from {source_rate} Hz to {rate} Hz");
        let mono = ChannelLayout::MONO;
        let packed = Sample::F32(sample::Type::Packed);
        // Without this bound, float audio mixed down from several channels exceeds 1.
        let options = Dictionary::from_iter([("rematrix_maxval", "1.0")]);
        let context = resampling::Context::get_with(sample, layout, source_rate, packed, mono, rate, options);
        let context = context.with_context(|| {
            format!("cannot convert {sample:?} audio of {} channels at {source_rate} Hz to mono", layout.channels())
        })?;
        Ok(Self { context, format, rate, n_in: 0, n_out: 0, n_compensated: 0, compensation_end: 0 })
    }

    pub(crate) fn format(&self) -> SoundFormat {
        self.format
    }

    /// Duration of the input after compensation, seconds.
    pub(crate) fn secs(&self) -> f64 {
        self.n_in as f64 / f64::from(self.format.rate) + self.n_compensated as f64 / f64::from(self.rate)
    }

    /// Whether no compensation is active.
    pub(crate) fn is_uncompensated(&self) -> bool {
        self.n_in >= self.compensation_end
    }

    /// Makes the next `over_secs` seconds longer by `secs` (shorter if negative).
    pub(crate) fn compensate_drift(&mut self, secs: f64, over_secs: f64) -> Result<()> {
        let n = (secs * f64::from(self.rate)).round() as i32;
        let over = (over_secs * f64::from(self.rate)) as i32;
        // SAFETY: the context is live and owned here.
        let done = unsafe { ffmpeg::ffi::swr_set_compensation(self.context.as_mut_ptr(), n, over) };
        ensure!(done >= 0, "swresample cannot compensate drift ({})", ffmpeg::Error::from(done));
        self.n_compensated += i64::from(n);
        self.compensation_end = self.n_in + (over_secs * f64::from(self.format.rate)) as u64;
        Ok(())
    }

    /// Converts a frame of this resampler's format and appends the samples that are ready to `out`.
    pub(crate) fn push(&mut self, frame: &frame::Audio, out: &mut Vec<f32>) -> Result<()> {
        debug_assert!(format_of(frame) == self.format);
        self.n_in += frame.samples() as u64;
        // SAFETY: `frame` is a decoded frame, whose extended_data holds a pointer for each of its planes.
        unsafe { self.convert((*frame.as_ptr()).extended_data.cast::<*const u8>(), frame.samples(), out) }
    }

    /// Appends the remaining samples, so that input and output have equal duration.
    pub(crate) fn finish(mut self, out: &mut Vec<f32>) -> Result<()> {
        let start = out.len();
        // SAFETY: null input means flush.
        unsafe { self.convert(std::ptr::null_mut(), 0, out)? };
        let n_all = (self.n_in * u64::from(self.rate) + u64::from(self.format.rate) / 2) / u64::from(self.format.rate);
        let n_all = n_all.saturating_add_signed(self.n_compensated);
        let n_extra = usize::try_from(self.n_out.saturating_sub(n_all)).unwrap_or(usize::MAX);
        out.truncate(out.len().saturating_sub(n_extra).max(start));
        Ok(())
    }

    /// # Safety
    /// `planes` is null or points to the planes of `n_samples` samples in this resampler's input format.
    unsafe fn convert(&mut self, planes: *mut *const u8, n_samples: usize, out: &mut Vec<f32>) -> Result<()> {
        let n_samples = i32::try_from(n_samples)?;
        let start = out.len();
        // SAFETY: `out` is given the capacity that swresample reports, and truncated to the samples written.
        let n_out = unsafe {
            let context = self.context.as_mut_ptr();
            let capacity = ffmpeg::ffi::swr_get_out_samples(context, n_samples).max(0) + 32;
            out.resize(start + capacity as usize, 0.0);
            let mut plane = out.as_mut_ptr().add(start).cast::<u8>();
            ffmpeg::ffi::swr_convert(context, &raw mut plane, capacity, planes, n_samples)
        };
        out.truncate(start + usize::try_from(n_out).unwrap_or(0));
        ensure!(n_out >= 0, "swresample failed ({})", ffmpeg::Error::from(n_out));
        self.n_out += n_out as u64;
        Ok(())
    }
}
