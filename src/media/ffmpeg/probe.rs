//! Headers of a media file, without decoding. Missing values stay unknown; a file with neither pictures nor sound is an
//! error.

use super::orientation::Orientation;
use super::source;
use anyhow::Result;
use ffmpeg_next::Rational;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::format::stream::Stream;
use orator_base::types::time::FrameRate;
use std::path::Path;

/// Streams of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbedMedia {
    /// Length as stated: of the pictures if there are any, else of the sound; `None` if no header says.
    pub duration_secs: Option<f64>,
    pub video: Option<VideoInfo>,
    pub audio: Option<AudioInfo>,
}

/// Stream of pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct VideoInfo {
    /// ffmpeg's name: `h264`, `hevc`, `vp9`.
    pub codec: String,
    /// Width and height in px as coded.
    pub coded_size: [usize; 2],
    /// Width and height in px as shown: turned upright, with square pixels.
    pub image_size: [usize; 2],
    /// Degrees clockwise from coded to upright: 0, 90, 180 or 270.
    pub rotation: u32,
    /// Average frames a second; `None` if no header says.
    pub fps: Option<FrameRate>,
}

/// Stream of sound.
#[derive(Clone, Debug, PartialEq)]
pub struct AudioInfo {
    /// ffmpeg's name: `aac`, `opus`, `pcm_s16le`.
    pub codec: String,
    /// Samples a second.
    pub rate: u32,
    pub n_channels: u32,
}

/// Reads the headers of `path`.
pub fn probe(path: &Path) -> Result<ProbedMedia> {
    Ok(describe(&source::open(path)?))
}

pub(crate) fn describe(input: &Input) -> ProbedMedia {
    let video = source::video_stream(input);
    let audio = source::automatic_track(input);
    let duration_secs = video.as_ref().or(audio.as_ref()).and_then(|stream| source::stated_secs(input, stream));
    ProbedMedia {
        duration_secs,
        video: video.map(|stream| describe_video(&stream)),
        audio: audio.map(|stream| {
            let [rate, n_channels] = source::sound_numbers(&stream);
            AudioInfo { codec: codec_name(&stream), rate, n_channels }
        }),
    }
}

fn describe_video(stream: &Stream) -> VideoInfo {
    // SAFETY: the parameters belong to `stream` and are only read here.
    let (width, height, aspect) = unsafe {
        let parameters = stream.parameters();
        let parameters = parameters.as_ptr();
        ((*parameters).width, (*parameters).height, (*parameters).sample_aspect_ratio)
    };
    let coded_size = [width, height].map(|n| usize::try_from(n).unwrap_or(0));
    let orientation = Orientation::from_stream(stream);
    let fps = [stream.avg_frame_rate(), stream.rate()].into_iter().find_map(frame_rate);
    let image_size = orientation.upright_size(square_pixels(coded_size, Rational::from(aspect)));
    VideoInfo { codec: codec_name(stream), coded_size, image_size, rotation: orientation.degrees(), fps }
}

/// Size with square pixels: the width stretched by the sample aspect ratio where that differs from 1 by more than a
/// hundredth and less than a factor 4 (other values are errors of an encoder).
pub(crate) fn square_pixels([width, height]: [usize; 2], aspect: Rational) -> [usize; 2] {
    let ratio = f64::from(aspect);
    let believable = ratio.is_finite() && (0.25..=4.0).contains(&ratio) && (ratio - 1.0).abs() > 0.01;
    if believable { [((width as f64 * ratio).round() as usize).max(1), height] } else { [width, height] }
}

fn frame_rate(rate: Rational) -> Option<FrameRate> {
    let num = u32::try_from(rate.numerator()).ok().filter(|n| *n > 0)?;
    let den = u32::try_from(rate.denominator()).ok().filter(|n| *n > 0)?;
    Some(FrameRate::new(num, den))
}

fn codec_name(stream: &Stream) -> String {
    stream.parameters().id().name().to_owned()
}
