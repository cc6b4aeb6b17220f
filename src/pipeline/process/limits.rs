//! Memory and time limits of a subprocess, derived from the picture size and the duration of the video. They are
//! several times what real videos need (measured in the guide), so that only malicious or broken files reach them.

use super::message::MediaHeader;
use anyhow::{Error, Result};
use orator_media::ffmpeg::decode::MAX_PIXELS;
use orator_media::ffmpeg::source::MAX_SECS;
use rustix::process::{Resource, Rlimit, setrlimit};
use std::path::Path;

/// Base allowance in bytes: program, libraries and model tensors.
const BASE_BYTES: f64 = (2_u64 << 30) as f64;
/// Bytes per pixel: 16 reference pictures and the display queue of the decoder at 6 bytes per pixel, and RGB copies.
const BYTES_PER_PIXEL: f64 = 128.0;
/// Bytes per frame at the dataset rate: keypoints, times and scores.
const BYTES_PER_FRAME: f64 = 4096.0;
/// Bytes of memory per byte of a model or of an earlier stage's output.
const MEMORY_PER_BYTE: f64 = 8.0;
/// Largest share of the machine's memory for one process.
const MACHINE_SHARE: f64 = 0.75;
/// CPU seconds for loading libraries and models.
const BASE_SECS: f64 = 3600.0;
/// CPU seconds per frame of the file, and per megapixel of a frame.
const SECS_PER_FRAME: f64 = 1.0;
const SECS_PER_MEGAPIXEL: f64 = 0.5;
/// Range to which the stated frame rate is clamped, fps.
const FPS: [f64; 2] = [60.0, 240.0];
/// Seconds without CPU use and without a report after which a process counts as hanging.
const IDLE_SECS: u64 = 900;

#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Bytes of private writable memory.
    pub memory: u64,
    /// CPU seconds; the limit of elapsed time is ten times this.
    pub cpu_secs: u64,
    /// CPU seconds between two progress reports.
    pub report_secs: u64,
    /// Seconds without CPU use and without a report.
    pub idle_secs: u64,
    /// Input that the limits were derived from, for messages.
    pub basis: String,
}

impl Limits {
    /// Limits for reading a header, when the size is not known yet.
    pub fn of_header() -> Self {
        Self::new(BASE_BYTES, BASE_SECS, "the header of a file".to_owned())
    }

    /// Limits for keypoints of other programs, which have no video header.
    pub fn of_machine() -> Self {
        let longest = FPS[1] * MAX_SECS;
        Self::new(f64::INFINITY, BASE_SECS + longest * SECS_PER_FRAME, "a file on this machine".to_owned())
    }

    /// Limits for a video with this header, sampled at `rate`; `n_bytes` is the size of models and other inputs.
    pub fn of_video(header: &MediaHeader, rate: f64, n_bytes: u64) -> Self {
        let [width, height] = header.image_size;
        let pixels = width.saturating_mul(height).min(MAX_PIXELS as usize) as f64;
        let stated = header.secs.filter(|secs| secs.is_finite() && *secs > 0.0);
        // The reader continues for up to a minute past the stated end.
        let secs = stated.map_or(MAX_SECS, |secs| MAX_SECS.min(secs + 60.0));
        let memory =
            BASE_BYTES + BYTES_PER_PIXEL * pixels + BYTES_PER_FRAME * secs * rate + MEMORY_PER_BYTE * n_bytes as f64;
        let fps = header.fps.filter(|fps| fps.is_finite()).unwrap_or(0.0).clamp(FPS[0], FPS[1]);
        let n_frames = secs * fps;
        let cpu_secs = BASE_SECS + n_frames * (SECS_PER_FRAME + SECS_PER_MEGAPIXEL * pixels / 1e6);
        Self::new(memory, cpu_secs, format!("{:.0} s of {width}x{height} video", secs.ceil()))
    }

    fn new(memory: f64, cpu_secs: f64, basis: String) -> Self {
        let machine = rustix::system::sysinfo();
        let machine = machine.totalram as f64 * f64::from(machine.mem_unit) * MACHINE_SHARE;
        Self {
            memory: memory.min(machine) as u64,
            cpu_secs: cpu_secs as u64,
            report_secs: (BASE_SECS + cpu_secs / 8.0) as u64,
            idle_secs: IDLE_SECS,
            basis,
        }
    }

    /// Adds the memory limit to the message of an out-of-memory error; other errors are returned unchanged.
    pub fn explain(&self, source: &Path, error: Error) -> Error {
        if !is_out_of_memory(&format!("{error:#}")) {
            return error;
        }
        error.context(format!(
            "{}: reading it needs more than the {} MiB of memory allowed for {}. The file may be damaged or malicious: \
             re-encode it, at a lower resolution if needed",
            source.display(),
            self.memory >> 20,
            self.basis
        ))
    }

    /// Returns the message for a process that uses `bytes` of memory; `None`: within the limit.
    pub fn exceeded_by(&self, bytes: u64) -> Option<String> {
        (bytes > self.memory).then(|| {
            format!(
                "used more than the {} MiB of memory allowed for {} and was killed. The file may be damaged or \
                 malicious: re-encode it, at a lower resolution if needed",
                self.memory >> 20,
                self.basis
            )
        })
    }

    /// Describes the limit that a process has exceeded, or `None`. `cpu`: CPU seconds used, `quiet`: CPU seconds since
    /// the last report, `passed`: seconds elapsed, `idle`: seconds without CPU use and without a report.
    pub fn passed(&self, [cpu, quiet]: [f64; 2], [passed, idle]: [u64; 2]) -> Option<String> {
        let excess = if idle >= self.idle_secs {
            format!("was idle for {}", span(self.idle_secs))
        } else if quiet > self.report_secs as f64 {
            format!("reported no progress in {} of CPU time", span(self.report_secs))
        } else if cpu > self.cpu_secs as f64 {
            format!("used more than the {} of CPU time allowed for {}", span(self.cpu_secs), self.basis)
        } else if passed > self.cpu_secs.saturating_mul(10) {
            format!("took more than the {} allowed for {}", span(self.cpu_secs.saturating_mul(10)), self.basis)
        } else {
            return None;
        };
        Some(format!("{excess} and was killed. The file may be damaged or malicious: copy or encode it again"))
    }
}

/// Limits the private memory of this process irrevocably.
pub fn limit_memory(bytes: u64) -> Result<()> {
    Ok(setrlimit(Resource::Data, Rlimit { current: Some(bytes), maximum: Some(bytes) })?)
}

/// Whether a message reports memory exhaustion, as worded by Rust, the C library, ffmpeg, OpenCV or ONNX Runtime.
fn is_out_of_memory(text: &str) -> bool {
    let text = text.to_lowercase();
    let reports = [
        "memory allocation of",
        "allocate memory",
        "bad_alloc",
        "bad allocation",
        "insufficient memory",
        "out of memory",
        "failed to map segment",
    ];
    reports.iter().any(|report| text.contains(report))
}

/// Formats a duration: `90 s`, `15 min`, `30 h`.
fn span(secs: u64) -> String {
    match secs {
        0..120 => format!("{secs} s"),
        120..7200 => format!("{} min", secs / 60),
        _ => format!("{} h", secs / 3600),
    }
}
