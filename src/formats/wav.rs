//! 16-bit mono WAV with the plain 44-byte header, written to memory or to a file, and the sample range of such a
//! file, so that a part of it can be read. Audio files from elsewhere are decoded by `ffmpeg` of the media crate.

use anyhow::{Context, Result, ensure};
use hound::{SampleFormat, WavReader, WavSpec};
use orator_base::types::sound::Sound;
use std::fs::File;
use std::io::{BufReader, BufWriter, Cursor, Seek, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Size of the header, bytes.
pub const HEADER_BYTES: usize = 44;

const fn spec(rate: u32) -> WavSpec {
    WavSpec { channels: 1, sample_rate: rate, bits_per_sample: 16, sample_format: SampleFormat::Int }
}

/// Writes samples clipped to -1..1; samples read from such a file are written back bit for bit.
fn push<W: Write + Seek>(file: &mut hound::WavWriter<W>, samples: &[f32]) -> hound::Result<()> {
    let mut writer = file.get_i16_writer(samples.len() as u32);
    for sample in samples {
        let value = f64::from(sample * 32_768.0);
        // Rounds half away from zero exactly like `round`, which is a slow function call.
        writer.write_sample((value + 0.5f64.copysign(value)) as i16);
    }
    writer.flush()
}

/// Contents of a WAV file.
///
/// # Errors
///
/// More than 4 GB of samples.
pub fn to_bytes(sound: &Sound) -> Result<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::with_capacity(HEADER_BYTES + 2 * sound.samples.len()));
    let mut file = hound::WavWriter::new(&mut bytes, spec(sound.rate))?;
    push(&mut file, &sound.samples)?;
    file.finalize()?;
    Ok(bytes.into_inner())
}

pub fn write(out: &Path, sound: &Sound) -> Result<()> {
    let mut wav = WavWriter::create(out, sound.rate)?;
    wav.push(&sound.samples)?;
    wav.finish()
}

/// A WAV file written in chunks.
pub struct WavWriter {
    path: PathBuf,
    file: hound::WavWriter<BufWriter<File>>,
}

impl WavWriter {
    /// Creates a file with `rate` samples per second.
    pub fn create(path: &Path, rate: u32) -> Result<Self> {
        let file = hound::WavWriter::create(path, spec(rate));
        Ok(Self { path: path.to_owned(), file: file.with_context(|| format!("cannot write {}", path.display()))? })
    }

    pub fn push(&mut self, samples: &[f32]) -> Result<()> {
        push(&mut self.file, samples).with_context(|| format!("cannot write {}", self.path.display()))
    }

    /// Completes the header and closes the file.
    pub fn finish(self) -> Result<()> {
        self.file.finalize().with_context(|| format!("cannot write {}", self.path.display()))
    }
}

/// A mono 16-bit WAV file that is read by ranges, with constant memory. It stays readable after its path is removed.
pub struct WavRanges {
    path: PathBuf,
    file: hound::WavReader<BufReader<File>>,
}

impl WavRanges {
    /// Opens a file with `rate` samples per second.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or has another format.
    pub fn open(path: &Path, rate: u32) -> Result<Self> {
        let file = hound::WavReader::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        ensure!(file.spec() == spec(rate), "{} is not a 16-bit mono WAV file at {rate} Hz", path.display());
        Ok(Self { path: path.to_owned(), file })
    }

    pub fn n_samples(&self) -> usize {
        self.file.duration() as usize
    }

    /// Samples in -1..1 of a range, cut at the end of the file.
    pub fn read(&mut self, range: Range<usize>) -> Result<Vec<f32>> {
        let reading = || format!("cannot read {}", self.path.display());
        let start = range.start.min(self.file.duration() as usize);
        self.file.seek(u32::try_from(start)?).with_context(reading)?;
        let samples = self.file.samples::<i16>().take(range.len());
        samples.map(|sample| Ok(f32::from(sample.with_context(reading)?) / 32_768.0)).collect()
    }
}

/// Number of samples in a file of `file_bytes` bytes that begins with `bytes`.
///
/// # Errors
///
/// The file does not have the header that this module writes for `rate`, or is truncated.
pub fn n_samples(bytes: &[u8], file_bytes: u64, rate: u32) -> Result<usize> {
    let mut head = Cursor::new(&bytes[..bytes.len().min(HEADER_BYTES)]);
    let found = WavReader::new(&mut head).ok().map(|reader| (reader.spec(), reader.len() as usize));
    let is_complete = |n: &usize| head.position() == HEADER_BYTES as u64 && file_bytes == (HEADER_BYTES + 2 * n) as u64;
    let n_samples = found.filter(|(found, n)| *found == spec(rate) && is_complete(n)).map(|(_, n)| n);
    ensure!(n_samples.is_some(), "not a 16-bit mono WAV file at {rate} Hz with a 44-byte header");
    Ok(n_samples.unwrap_or_default())
}

/// Little-endian 16-bit samples scaled to -1..1.
pub fn samples(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(2).map(|b| f32::from(i16::from_le_bytes([b[0], b[1]])) / 32_768.0).collect()
}
