//! Reads the headers of a file without decoding. Missing values are `None`; a file without video and audio is an error.

use super::orientation::Orientation;
use super::source;
use anyhow::Result;
use ffmpeg_next::Rational;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::format::stream::Stream;
use orator_base::types::time::FrameRate;
use std::path::Path;

#[derive(Clone, Debug, PartialEq)]
pub struct ProbedMedia {
    /// Stated length, seconds: of the video stream, or else of the audio stream; `None` if no header states it.
    pub duration_secs: Option<f64>,
    pub video: Option<VideoInfo>,
    pub audio: Option<AudioInfo>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct VideoInfo {
    /// Codec name used by ffmpeg: `h264`, `hevc`, `vp9`.
    pub codec: String,
    /// Width and height in px as coded.
    pub coded_size: [usize; 2],
    /// Width and height in px as displayed: upright, with square pixels.
    pub image_size: [usize; 2],
    /// Clockwise rotation from coded to upright image, degrees: 0, 90, 180 or 270.
    pub rotation: u32,
    /// Average frame rate; `None` if no header states it.
    pub fps: Option<FrameRate>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct AudioInfo {
    /// Codec name used by ffmpeg: `aac`, `opus`, `pcm_s16le`.
    pub codec: String,
    /// Samples per second.
    pub rate: u32,
    pub n_channels: u32,
}

/// Reads the headers of `path`.
pub fn probe(path: &Path) -> Result<ProbedMedia> {
    Ok(describe(&source::open(path)?))
}

pub(crate) fn describe(input: &Input) -> ProbedMedia {
    let video = source::video_stream(input);
    let audio = source::default_track(input);
    let duration_secs = video.as_ref().or(audio.as_ref()).and_then(|stream| source::stated_secs(input, stream));
    ProbedMedia {
        duration_secs,
        video: video.map(|stream| describe_video(&stream)),
        audio: audio.map(|stream| {
            let [rate, n_channels] = source::audio_parameters(&stream);
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

/// Size with square pixels: the width is scaled by the sample aspect ratio if that differs from 1 by more than 1 %
/// and by less than a factor of 4 (other values are encoder errors).
pub(crate) fn square_pixels([width, height]: [usize; 2], aspect: Rational) -> [usize; 2] {
    let ratio = f64::from(aspect);
    let is_plausible = ratio.is_finite() && (0.25..=4.0).contains(&ratio) && (ratio - 1.0).abs() > 0.01;
    if is_plausible { [((width as f64 * ratio).round() as usize).max(1), height] } else { [width, height] }
}

fn frame_rate(rate: Rational) -> Option<FrameRate> {
    let num = u32::try_from(rate.numerator()).ok().filter(|n| *n > 0)?;
    let den = u32::try_from(rate.denominator()).ok().filter(|n| *n > 0)?;
    Some(FrameRate::new(num, den))
}

fn codec_name(stream: &Stream) -> String {
    stream.parameters().id().name().to_owned()
}
