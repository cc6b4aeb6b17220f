//! Clips the tests make themselves: every picture carries its number as eight blocks, so that a test reads back which
//! source frame came out; and the `ffmpeg` command for what the project itself never writes.

use orator::media::encode::VideoWriter;
use orator::types::image::Image;
use orator::types::sound::Sound;
use orator::types::time::FrameRate;
use std::path::{Path, PathBuf};
use std::process::Command;

pub const WIDTH: usize = 128;
pub const HEIGHT: usize = 64;

/// Picture number `number`: its eight bits as blocks, highest first, black or white, in the lower half; the upper half
/// is red.
pub fn numbered(number: usize, width: usize, height: usize) -> Image {
    let mut image = Image::filled(width, height, [200, 20, 20]);
    for y in height / 2..height {
        for x in 0..width {
            let bit = (number >> (7 - (8 * x / width))) & 1;
            let at = 3 * (y * width + x);
            image.data[at..at + 3].fill(if bit == 1 { 235 } else { 16 });
        }
    }
    image
}

/// The number `numbered` drew.
pub fn number_of(image: &Image) -> usize {
    let y = 3 * image.height / 4;
    (0..8).fold(0, |number, block| {
        let x = (2 * block + 1) * image.width / 16;
        2 * number + usize::from(image.pixel(x, y)[1] > 128)
    })
}

/// Writes pictures 0..n to `name` in `dir`.
pub fn write_numbered(dir: &Path, name: &str, n: usize, fps: FrameRate, sound: Option<&Sound>) -> PathBuf {
    write_sized(dir, name, n, fps, [WIDTH, HEIGHT], sound)
}

pub fn write_sized(
    dir: &Path,
    name: &str,
    n: usize,
    fps: FrameRate,
    size: [usize; 2],
    sound: Option<&Sound>,
) -> PathBuf {
    let path = dir.join(name);
    let mut video = VideoWriter::create(&path, size[0], size[1], fps, sound).unwrap();
    for number in 0..n {
        video.push(&numbered(number, size[0], size[1])).unwrap();
    }
    video.finish().unwrap();
    path
}

/// A sine of `secs` seconds.
pub fn tone(rate: u32, secs: f64, hertz: f64) -> Sound {
    let n = (secs * f64::from(rate)).round() as usize;
    let wave = |k: usize| (std::f64::consts::TAU * hertz * k as f64 / f64::from(rate)).sin() as f32 * 0.5;
    Sound { rate, samples: (0..n).map(wave).collect() }
}

/// Runs the `ffmpeg` command with `args` (split at spaces) in `dir`; false, with a loud line, where there is none or it
/// cannot do this.
pub fn ffmpeg(dir: &Path, args: &str) -> bool {
    let command =
        Command::new("ffmpeg").args(["-v", "error", "-nostdin", "-y"]).args(args.split(' ')).current_dir(dir).output();
    match command {
        Ok(output) if output.status.success() => true,
        Ok(output) => {
            eprintln!("SKIPPED: `ffmpeg {args}` failed: {}", String::from_utf8_lossy(&output.stderr).trim());
            false
        }
        Err(error) => {
            eprintln!("SKIPPED: no ffmpeg command ({error})");
            false
        }
    }
}
