//! Decodes one stream frame by frame, with presentation times. Broken packets are counted and skipped.

use super::clock::StreamClock;
use anyhow::{Context, Result, ensure};
use ffmpeg_next as ffmpeg;
use ffmpeg_next::{Frame, Packet, Rational, codec, decoder, format, media};
use std::path::{Path, PathBuf};

/// Maximum number of pixels of an image, twice that of 8K; a short header may claim any size.
pub const MAX_PIXELS: i64 = 1 << 26;

/// Decoder with its open input.
pub(crate) struct StreamDecoder {
    path: PathBuf,
    input: format::context::Input,
    stream_idx: usize,
    decoder: decoder::Opened,
    /// Clock of the packets; `None` if it cannot jump, or after a seek.
    clock: Option<StreamClock>,
    time_base: Rational,
    draining: bool,
    n_bad: usize,
    n_flawed: usize,
    stopped: Option<ffmpeg::Error>,
}

impl StreamDecoder {
    /// Creates a decoder of stream `stream_idx` with `threads` threads (0: one per core). Other streams are not read.
    pub(crate) fn new(
        path: &Path,
        mut input: format::context::Input,
        stream_idx: usize,
        threads: usize,
    ) -> Result<Self> {
        for idx in 0..input.nb_streams() as usize {
            if idx != stream_idx {
                // SAFETY: idx is below nb_streams, and the context is owned here.
                unsafe {
                    (**(*input.as_mut_ptr()).streams.add(idx)).discard = ffmpeg::ffi::AVDiscard::AVDISCARD_ALL;
                }
            }
        }
        let stream =
            input.stream(stream_idx).with_context(|| format!("{} has no stream {stream_idx}", path.display()))?;
        let time_base = stream.time_base();
        let parameters = stream.parameters();
        let (id, medium) = (parameters.id(), parameters.medium());
        let kind = if medium == media::Type::Audio { "audio" } else { "images" };
        let open = || -> Result<decoder::Opened, ffmpeg::Error> {
            let mut context = codec::Context::from_parameters(parameters)?;
            context.set_threading(codec::threading::Config::count(threads));
            // SAFETY: the context is owned here and not open yet.
            unsafe { (*context.as_mut_ptr()).max_pixels = MAX_PIXELS };
            let mut decoder = context.decoder();
            decoder.set_packet_time_base(time_base);
            decoder.open_as(decoder::find(id).ok_or(ffmpeg::Error::DecoderNotFound)?)
        };
        let decoder =
            open().with_context(|| format!("cannot decode the {kind} of {}, codec {id:?}", path.display()))?;
        let clock = StreamClock::new(path, &input, stream_idx)?;
        let (path, draining, stopped) = (path.to_owned(), false, None);
        Ok(Self { path, input, stream_idx, decoder, clock, time_base, draining, n_bad: 0, n_flawed: 0, stopped })
    }

    /// Duration of one tick of the stream's clock, seconds, as a fraction.
    pub(crate) fn time_base(&self) -> Rational {
        self.time_base
    }

    /// Whether the clock of the container may jump, so that its stated length is not reliable.
    pub(crate) fn may_jump(&self) -> bool {
        self.clock.is_some()
    }

    /// Times in ticks at which another recording begins in a file of joined recordings, as far as it has been read.
    pub(crate) fn joins(&self) -> &[i64] {
        self.clock.as_ref().map_or(&[][..], StreamClock::joins)
    }

    /// Decodes the next frame into `frame`, in presentation order; false at the end.
    pub(crate) fn next(&mut self, frame: &mut Frame) -> Result<bool> {
        loop {
            match self.decoder.receive_frame(frame) {
                Ok(()) => {
                    self.n_flawed += usize::from(frame.is_corrupt() || frame.has_decode_errors());
                    return Ok(true);
                }
                Err(ffmpeg::Error::Eof) => return Ok(false),
                Err(ffmpeg::Error::Other { errno }) if errno == ffmpeg::error::EAGAIN => {
                    if self.draining {
                        return Ok(false);
                    }
                }
                Err(error) if is_out_of_memory(error) => return self.fail(error),
                // The remaining frames in the decoder are broken; the earlier ones are valid.
                Err(_) if self.draining && self.n_bad > 1000 => return Ok(false),
                Err(_) => self.n_bad += 1,
            }
            if !self.draining {
                self.feed()?;
            }
        }
    }

    /// Seeks to the last point at or before `ticks` of the stream's clock at which decoding can start, as far as the
    /// container knows. The next frames may be from another position, or flawed. Joined recordings cannot be sought.
    pub(crate) fn seek(&mut self, ticks: i64) -> Result<()> {
        ensure!(self.joins().is_empty(), "cannot seek in {}: it consists of joined recordings", self.path.display());
        self.clock = None;
        // SAFETY: the context is owned here, and the stream is one of its streams.
        let code = unsafe {
            ffmpeg::ffi::av_seek_frame(
                self.input.as_mut_ptr(),
                self.stream_idx as i32,
                ticks,
                ffmpeg::ffi::AVSEEK_FLAG_BACKWARD,
            )
        };
        if code < 0 {
            let error = ffmpeg::Error::from(code);
            return Err(error).with_context(|| format!("cannot seek in {}", self.path.display()));
        }
        self.decoder.flush();
        self.draining = false;
        Ok(())
    }

    /// Passes the next packet, or the end of the stream, to the decoder.
    fn feed(&mut self) -> Result<()> {
        let mut packet = Packet::empty();
        match packet.read(&mut self.input) {
            Ok(()) if packet.stream() != self.stream_idx => {}
            Ok(()) => {
                if let Some(clock) = &mut self.clock {
                    clock.correct(&mut packet)?;
                }
                match self.decoder.send_packet(&packet) {
                    Ok(()) => {}
                    Err(error) if is_out_of_memory(error) => return self.fail(error),
                    Err(_) => self.n_bad += 1,
                }
            }
            Err(error) => {
                if error != ffmpeg::Error::Eof {
                    self.stopped = Some(error);
                }
                self.draining = true;
                let ended = self.decoder.send_eof();
                ended.with_context(|| format!("cannot finish decoding {}", self.path.display()))?;
            }
        }
        Ok(())
    }

    /// Out of memory is an error rather than damage: the same file must not yield fewer frames on a smaller machine.
    fn fail<T>(&self, error: ffmpeg::Error) -> Result<T> {
        Err(error).with_context(|| format!("cannot decode {}", self.path.display()))
    }

    /// Description of damage, if any.
    pub(crate) fn damage(&self) -> Option<String> {
        let stopped = self.stopped.map(|error| format!("reading broke off ({error})"));
        let bad = (self.n_bad > 0).then(|| format!("{} packets could not be decoded", self.n_bad));
        let flawed = (self.n_flawed > 0).then(|| format!("{} frames are flawed", self.n_flawed));
        let parts: Vec<String> = stopped.into_iter().chain(bad).chain(flawed).collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }
}

fn is_out_of_memory(error: ffmpeg::Error) -> bool {
    matches!(error, ffmpeg::Error::Other { errno: ffmpeg::error::ENOMEM })
}
