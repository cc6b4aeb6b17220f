//! The generator for sound of any length in constant memory: audio encoder and UNet run piece by piece, each piece
//! with enough context that the padding at its ends does not affect the part that is used. Pieces start at multiples
//! of all strides, and the resize between encoder and UNet counts from the start of the sound, so the result equals
//! that of one pass. With a limited look-ahead (`look_ahead`) no sound is read before it is needed, so the
//! length of the sound may be unknown, and a chunk may have any number of frames.

use super::generator::{FRAMES_MULTIPLE, Generator, Preset};
use super::words::WordFrames;
use crate::ops::resize::{ResizedPart, linear_part};
use candle_core::{Result, Tensor};
use std::ops::Range;

/// Number of spectrogram frames per result of the audio encoder.
pub(super) const HOPS: usize = 8;
/// Number of results of the audio encoder per piece: 20 s of sound.
const PIECE: usize = 256;

/// Result `i` of the audio encoder depends on this many spectrogram frames before `8 i`, and on those up to `8 i` plus
/// [`audio_after`].
///
/// These numbers follow from kernel and stride of each layer. With TensorFlow's "same" padding a layer of kernel 3 and
/// stride 1 computes position `i` from `i - 1..=i + 1`, and one of kernel 4 and stride 2 from `2 i - 1..=2 i + 2`, for
/// even and odd lengths alike (both pad one position at the start); the last layer of `paper` is not padded and reads
/// `i..=i + 2`.
const AUDIO_BEFORE: usize = 22;
/// Number of frames before and after 32 pose frames that the UNet reads for them.
pub const FRAMES_READ_AHEAD: usize = 97;
/// This number, rounded up to complete pieces.
const MARGIN: usize = FRAMES_READ_AHEAD.next_multiple_of(FRAMES_MULTIPLE);
/// Number of frames before a pose frame that the UNet reads with a limited look-ahead, rounded up likewise: 8 for
/// the decoder and 4 for `enter`, and `n -> 2 n + 6` for each of the 5 levels in between.
const CAUSAL_MARGIN: usize = 198usize.next_multiple_of(FRAMES_MULTIPLE);

/// Index of the last spectrogram frame, counted from `8 i`, on which result `i` of the audio encoder depends.
pub(super) const fn audio_after(preset: Preset) -> usize {
    match preset {
        Preset::Light => 29,
        Preset::Paper => 45,
    }
}

/// Number of results of the audio encoder for `n_mel_frames` spectrogram frames.
pub fn n_encoded_frames(preset: Preset, n_mel_frames: usize) -> usize {
    let eighth = (0..3).fold(n_mel_frames, |n, _| n.div_ceil(2));
    if preset == Preset::Paper { eighth.saturating_sub(2) } else { eighth }
}

/// Generator over a sound of any length; yields the poses [1, n_out, T] of successive chunks.
pub struct StreamingGenerator<'a, M> {
    generator: &'a Generator,
    preset: Preset,
    /// Function that returns the log-mel spectrogram [1, n_mels, T_mel] of a range of frames.
    mels: M,
    /// Words at all frames, for a network with word input.
    words: Option<WordFrames>,
    n_mel_frames: usize,
    n_frames: usize,
    chunk: usize,
    /// First frame that has not been generated.
    next: usize,
    /// Results of the audio encoder that later chunks need, [1, n, width]; `first_encoded` is the index of the first
    /// one.
    encoded: Option<Tensor>,
    first_encoded: usize,
}

impl<'a, M: FnMut(Range<usize>) -> Result<Tensor>> StreamingGenerator<'a, M> {
    /// Creates a stream that converts `n_mel_frames` of sound to `n_frames` of poses, `chunk` at a time. The generator
    /// is one for a single speaker. `mels` is called with successive ranges of spectrogram frames. `n_frames` and
    /// `chunk` are multiples of 32, and `n_frames` covers the same time as the sound; with a limited look-ahead,
    /// `chunk` may be any number, and both numbers of frames only limit the stream.
    pub fn new(
        generator: &'a Generator,
        preset: Preset,
        n_mel_frames: usize,
        n_frames: usize,
        chunk: usize,
        mels: M,
    ) -> Result<Self> {
        let is_bounded = generator.look_ahead().is_some();
        for (what, n, is_free) in [("the audio", n_frames, false), ("a chunk", chunk, is_bounded)] {
            if n == 0 || !(is_free || n.is_multiple_of(FRAMES_MULTIPLE)) {
                candle_core::bail!("{what} has {n} frames: expected a multiple of {FRAMES_MULTIPLE}");
            }
        }
        if n_encoded_frames(preset, n_mel_frames) == 0 {
            candle_core::bail!("the spectrogram is too short for this network: {n_mel_frames} frames");
        }
        let (words, encoded) = (None, None);
        Ok(Self { generator, preset, mels, words, n_mel_frames, n_frames, chunk, next: 0, encoded, first_encoded: 0 })
    }

    /// Sets the words at all `n_frames` frames, for a network with word input.
    pub fn with_words(self, words: Option<WordFrames>) -> Self {
        Self { words, ..self }
    }

    fn chunk(&mut self, frames: Range<usize>) -> Result<Tensor> {
        let n_encoded = n_encoded_frames(self.preset, self.n_mel_frames);
        let (first, end, ratio) = match self.generator.look_ahead() {
            None => {
                let end = (frames.end + MARGIN).min(self.n_frames);
                (frames.start.saturating_sub(MARGIN), end, (n_encoded, self.n_frames))
            }
            Some(of) => {
                let first = frames.start.saturating_sub(CAUSAL_MARGIN) / FRAMES_MULTIPLE * FRAMES_MULTIPLE;
                (first, frames.end, of.encoded_per_frame)
            }
        };
        let part = ResizedPart { ratio, ..ResizedPart::new(first..end, n_encoded, self.n_frames) };
        let needed = part.needed();
        self.encode_until(needed.clone(), n_encoded)?;
        let Some(encoded) = &self.encoded else { candle_core::bail!("no encoded audio frames are buffered") };
        let encoded = encoded.narrow(1, needed.start - self.first_encoded, needed.len())?;
        let words = self.words.as_ref().map(|words| words.part(first..end)?.on(encoded.device())).transpose()?;
        let encoded = self.generator.with_words(linear_part(&encoded, &part)?, words.as_ref())?;
        let poses = self.generator.decode(&encoded, false)?;
        poses.narrow(2, frames.start - first, frames.len())
    }

    /// Ensures that these results of the audio encoder are buffered, and drops those before them.
    fn encode_until(&mut self, needed: Range<usize>, n_encoded: usize) -> Result<()> {
        let mut parts = Vec::new();
        let mut end = needed.start;
        if let Some(encoded) = self.encoded.take() {
            end = self.first_encoded + encoded.dim(1)?;
            parts.push(encoded.narrow(1, needed.start - self.first_encoded, end - needed.start)?);
        }
        self.first_encoded = needed.start;
        while end < needed.end {
            // The future may not be there yet.
            let last = if self.generator.look_ahead().is_some() { needed.end } else { n_encoded };
            let piece = end..(end + PIECE).min(last);
            end = piece.end;
            parts.push(self.encode(piece, n_encoded)?);
        }
        // Copied, so that the memory of the dropped results is freed.
        self.encoded = Some(Tensor::cat(&parts, 1)?.force_contiguous()?);
        Ok(())
    }

    /// Computes these results of the audio encoder.
    fn encode(&mut self, piece: Range<usize>, n_encoded: usize) -> Result<Tensor> {
        let first = piece.start.saturating_sub(AUDIO_BEFORE.div_ceil(HOPS));
        let end = match piece.end {
            end if end == n_encoded => self.n_mel_frames,
            end => ((end - 1) * HOPS + audio_after(self.preset) + 1).min(self.n_mel_frames),
        };
        let mels = (self.mels)(first * HOPS..end)?.to_device(self.generator.device())?;
        let encoded = self.generator.encode(&mels, &[], false)?;
        encoded.narrow(1, piece.start - first, piece.len())
    }
}

impl<M: FnMut(Range<usize>) -> Result<Tensor>> Iterator for StreamingGenerator<'_, M> {
    type Item = Result<Tensor>;

    fn next(&mut self) -> Option<Self::Item> {
        let frames = self.next..(self.next + self.chunk).min(self.n_frames);
        if frames.is_empty() {
            return None;
        }
        self.next = frames.end;
        let poses = self.chunk(frames);
        if poses.is_err() {
            self.next = self.n_frames;
        }
        Some(poses)
    }
}
