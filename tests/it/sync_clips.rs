//! Clips whose every picture and every beep has a known time: pictures carry their number and a flash, the sound carries
//! a chirp at the moment of each flash. Times come from the way a clip is made, by the `ffmpeg` command, never from the
//! code under test.

use orator::types::image::Image;
use orator::types::time::FrameRate;
use std::f64::consts::TAU;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const WIDTH: usize = 64;
const HEIGHT: usize = 48;
/// A flash every so many seconds, so that it falls on every phase of the frames, lasting so long at least.
const FLASH_EVERY_SECS: f64 = 2.37;
const FLASH_SECS: f64 = 0.41;
const CHIRP_SECS: f64 = 0.12;
const CHIRP_HERTZ: [f64; 2] = [300.0, 3000.0];

/// When picture n is shown.
#[derive(Clone, Copy)]
pub enum Pace {
    Constant(u32, u32),
    /// About 30 a second with 12 ms of sway, every third hundred at about 12 a second.
    Variable,
}

impl Pace {
    pub fn secs(self, n: usize) -> f64 {
        match self {
            Self::Constant(num, den) => FrameRate::new(num, den).secs(n),
            Self::Variable => {
                let slow = (n / 300 * 100 + (n % 300).saturating_sub(200)) as f64;
                n as f64 / 30.0 + 0.012 * (n as f64 * 0.9).sin() + 0.05 * slow
            }
        }
    }

    fn rate(self) -> String {
        match self {
            Self::Constant(num, den) => format!("{num}/{den}"),
            Self::Variable => "30".to_owned(),
        }
    }

    /// The options that give pictures these times: the same formula, in ffmpeg's language.
    fn options(self) -> &'static str {
        match self {
            Self::Constant(..) => "-vsync passthrough",
            Self::Variable => {
                "-vf settb=1/90000,setpts=round(90000*(N/30+0.012*sin(N*0.9)+0.05*(floor(N/300)*100+max(mod(N\\,300)-200\\,0)))) \
                 -vsync passthrough -enc_time_base 1:90000 -video_track_timescale 90000"
            }
        }
    }
}

/// How a clip is made.
#[derive(Clone, Copy)]
pub struct Kind {
    /// The file's name; its extension is the container.
    pub name: &'static str,
    pub pace: Pace,
    pub secs: f64,
    pub sound_rate: u32,
    /// Seconds after the first picture at which the first sample of the wav belongs, by the options.
    pub sound_at: f64,
    /// Seconds that a second of the wav lasts, by the options.
    pub sound_pace: f64,
    /// How far the sound's times are off beyond the rounding of the container, seconds.
    pub jitter_secs: f64,
    /// Options before the pictures and before the sound.
    pub before: [&'static str; 2],
    /// Codec of the pictures, of the sound, and what the container is told.
    pub video: &'static str,
    pub sound: &'static str,
    pub container: &'static str,
    /// Options before and after the input of a second command, should it take one.
    pub then: [&'static str; 2],
}

/// H.264 and AAC, 30 pictures a second.
pub const PLAIN: Kind = Kind {
    name: "plain.mp4",
    pace: Pace::Constant(30, 1),
    secs: 16.0,
    sound_rate: 48_000,
    sound_at: 0.0,
    sound_pace: 1.0,
    jitter_secs: 0.0,
    before: ["", ""],
    video: "-c:v libx264 -preset ultrafast -crf 20 -g 50 -bf 0",
    sound: "-c:a aac",
    container: "",
    then: ["", ""],
};

/// A clip with its truth.
pub struct Clip {
    pub path: PathBuf,
    /// Times of all pictures, seconds.
    pub pictures: Vec<f64>,
    pub flashes: Vec<Flash>,
}

/// Pictures `first..end` are bright. An event that a camera sees begin at picture `first` was, at best knowledge, midway
/// between that picture and the one before: there the chirp begins.
pub struct Flash {
    pub first: usize,
    pub end: usize,
    pub on_secs: f64,
    pub off_secs: f64,
}

fn flashes(pictures: &[f64]) -> Vec<Flash> {
    let mut flashes = Vec::new();
    let from = |secs: f64| pictures.partition_point(|at| *at < secs);
    let middle = |n: usize| (pictures[n - 1] + pictures[n]) / 2.0;
    for n in 0.. {
        let first = from(1.1 + FLASH_EVERY_SECS * f64::from(n)).max(1);
        let Some(at) = pictures.get(first) else { break };
        let end = from(at + FLASH_SECS).max(first + 1);
        if pictures.get(end + 1).is_none() {
            break;
        }
        flashes.push(Flash { first, end, on_secs: middle(first), off_secs: middle(end) });
    }
    flashes
}

/// Picture `number` in grey: its sixteen bits as blocks in the lower half, the flash in the upper half.
fn picture(number: usize, bright: bool) -> Vec<u8> {
    let mut grey = vec![if bright { 235 } else { 16 }; WIDTH * HEIGHT];
    for y in HEIGHT / 2..HEIGHT {
        for x in 0..WIDTH {
            let block = 8 * ((y - HEIGHT / 2) * 4 / HEIGHT) + 8 * x / WIDTH;
            grey[y * WIDTH + x] = if (number >> block) & 1 == 1 { 235 } else { 16 };
        }
    }
    grey
}

/// Number and brightness of a picture read back.
pub fn read_picture(image: &Image) -> (usize, bool) {
    assert_eq!([image.width, image.height], [WIDTH, HEIGHT]);
    let bright = |x, y| image.pixel(x, y)[1] > 128;
    let bit =
        |block: usize| usize::from(bright(4 + 8 * (block % 8), HEIGHT / 2 + 6 + HEIGHT / 4 * (block / 8))) << block;
    ((0..16).map(bit).sum(), bright(WIDTH / 2, HEIGHT / 4))
}

/// The chirp `secs` after its beginning.
pub fn chirp(secs: f64) -> f64 {
    if !(0.0..CHIRP_SECS).contains(&secs) {
        return 0.0;
    }
    let [low, high] = CHIRP_HERTZ;
    let turns = low * secs + (high - low) * secs * secs / (2.0 * CHIRP_SECS);
    0.25 * (1.0 - (TAU * secs / CHIRP_SECS).cos()) * (TAU * turns).sin()
}

/// Second at which the chirp begins in `samples`, sought within 40 ms of `near`: where the correlation with the chirp is
/// greatest, to a fraction of a sample.
pub fn chirp_begins(samples: &[f32], rate: u32, near: f64) -> f64 {
    let rate = f64::from(rate);
    let template: Vec<f32> = (0..(CHIRP_SECS * rate) as usize).map(|k| chirp(k as f64 / rate) as f32).collect();
    let reach = (0.04 * rate) as isize;
    let start = (near * rate).round() as isize - reach;
    let at = |lag: isize| {
        let from = usize::try_from(start + lag).expect("the chirp is near the beginning");
        samples[from..].iter().zip(&template).map(|(a, b)| a * b).sum::<f32>() as f64
    };
    let all: Vec<f64> = (0..=2 * reach).map(at).collect();
    let best = (1..all.len() - 1).max_by(|a, b| all[*a].total_cmp(&all[*b])).unwrap();
    assert!(all[best] > 1.0, "no chirp near {near:.3} s");
    let [a, b, c] = [all[best - 1], all[best], all[best + 1]];
    (start as f64 + best as f64 + (a - c) / (2.0 * (a - 2.0 * b + c))) / rate
}

fn write_sound(path: &Path, kind: &Kind, flashes: &[Flash]) {
    let rate = f64::from(kind.sound_rate);
    let spec = hound::WavSpec {
        channels: 1,
        sample_rate: kind.sound_rate,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut wav = hound::WavWriter::create(path, spec).unwrap();
    let mut left = flashes;
    for k in 0..((kind.secs - kind.sound_at) * rate) as usize {
        let secs = k as f64 / rate * kind.sound_pace + kind.sound_at;
        while left.first().is_some_and(|flash| flash.on_secs + CHIRP_SECS < secs) {
            left = &left[1..];
        }
        let value = left.first().map_or(0.0, |flash| chirp(secs - flash.on_secs));
        wav.write_sample((value * 32_767.0).round() as i16).unwrap();
    }
    wav.finalize().unwrap();
}

/// Makes a clip in `dir`; `None`, with a loud line, where the `ffmpeg` command is absent or cannot do this.
pub fn make(dir: &Path, kind: &Kind) -> Option<Clip> {
    let pictures: Vec<f64> = (0..).map(|n| kind.pace.secs(n)).take_while(|at| *at < kind.secs).collect();
    let flashes = flashes(&pictures);
    let wav = format!("{}.wav", kind.name);
    write_sound(&dir.join(&wav), kind, &flashes);
    let again = kind.then != ["", ""];
    let made = if again { format!("made_{}", kind.name) } else { kind.name.to_owned() };
    let ([before_pictures, before_sound], [seek, copy]) = (kind.before, kind.then);
    let args = format!(
        "{before_pictures} -f rawvideo -pix_fmt gray -s {WIDTH}x{HEIGHT} -framerate {} -i pipe:0 {before_sound} -i {wav} \
         -map 0:v -map 1:a {} -pix_fmt yuv420p {} {} {} {made}",
        kind.pace.rate(),
        kind.pace.options(),
        kind.video,
        kind.sound,
        kind.container,
    );
    let bright = |n: usize| flashes.iter().any(|flash| (flash.first..flash.end).contains(&n));
    let raw: Vec<u8> = (0..pictures.len()).flat_map(|n| picture(n, bright(n))).collect();
    let then = format!("{seek} -i {made} {copy} {}", kind.name);
    let done = ffmpeg(dir, &args, &raw) && (!again || ffmpeg(dir, &then, &[]));
    done.then(|| Clip { path: dir.join(kind.name), pictures, flashes })
}

fn ffmpeg(dir: &Path, args: &str, input: &[u8]) -> bool {
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-y"]).args(args.split_whitespace()).current_dir(dir);
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = match command.spawn() {
        Ok(child) => child,
        Err(error) => {
            eprintln!("SKIPPED: no ffmpeg command ({error})");
            return false;
        }
    };
    // A failing ffmpeg closes the pipe; its own words are shown below.
    let _ = child.stdin.take().map(|mut pipe| pipe.write_all(input));
    let output = child.wait_with_output().unwrap();
    if !output.status.success() {
        eprintln!("SKIPPED: `ffmpeg {args}` failed: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    output.status.success()
}
