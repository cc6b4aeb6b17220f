//! Initialisation of the ffmpeg libraries, and opening of media files: their streams, or an error that names the
//! file, the defect and what was expected.

use anyhow::{Context, Result, bail};
use ffmpeg_next as ffmpeg;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::format::stream::{Disposition, Stream};
use orator_base::input;
use orator_base::types::sound::AudioTracks;
use std::io::Read;
use std::ops::RangeInclusive;
use std::path::Path;

/// Self-contained containers. ffmpeg also opens playlists and lists (hls, dash, concat, sdp, numbered images), which
/// make it read arbitrary files that they name.
const FORMATS: &str = "mov,matroska,webm,avi,mpegts,mpeg,mpegvideo,h264,hevc,flv,ogg,wav,w64,mp3,flac,aac,ac3,eac3,aiff,au,caf,amr,\
    asf,mxf,gif,jpeg_pipe,png_pipe";
/// Plausible audio sample rates, samples per second.
const SAMPLE_RATES: RangeInclusive<u32> = 4_000..=768_000;

const EXPECTED: &str = "expected a video or audio file (mp4, mov, mkv, webm, avi, wav, flac, mp3, ...)";

/// Initialises ffmpeg once and disables its log output, since this crate reports every error.
pub(crate) fn init() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        // This registers nothing since ffmpeg 4 and cannot fail; a failure would show when the first file is opened.
        let _ = ffmpeg::init();
        ffmpeg::log::set_level(ffmpeg::log::Level::Quiet);
    });
}

/// Versions of the linked ffmpeg libraries, for instance `libavformat 59.27.100, libavcodec 59.37.100, ...`.
pub fn version() -> String {
    use ffmpeg::software::{resampling, scaling};
    let dotted = |v: u32| format!("{}.{}.{}", v >> 16, (v >> 8) & 255, v & 255);
    format!(
        "libavformat {}, libavcodec {}, libavfilter {}, libswscale {}, libswresample {}",
        dotted(ffmpeg::format::version()),
        dotted(ffmpeg::codec::version()),
        dotted(ffmpeg::filter::version()),
        dotted(scaling::version()),
        dotted(resampling::version())
    )
}

/// A file from which no image or audio can be read. The message names the file, the problem and the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UnreadableMedia(pub String);

/// Longest plausible time between two frames, and longest duration of the last one, seconds. Longer gaps would be
/// filled with repeated images or silence.
pub(crate) const MAX_GAP_SECS: f64 = 600.0;
/// Longest plausible video or audio, seconds (a day).
pub const MAX_SECS: f64 = 86_400.0;

/// Opens `path` and reads its headers.
pub(crate) fn open(path: &Path) -> Result<Input> {
    open_with(path, &[])
}

/// Opens `path` with options for the demuxer. Every image or audio file is opened here.
pub(crate) fn open_with(path: &Path, options: &[(&str, &str)]) -> Result<Input> {
    init();
    let name = path.display();
    let cannot = || UnreadableMedia(format!("cannot read {name}"));
    let unreadable = |problem: String| Err(UnreadableMedia(problem).into());
    if path.is_dir() {
        return unreadable(format!("{name} is a folder: {EXPECTED}"));
    }
    let mut file = input::open(path).with_context(|| UnreadableMedia(format!("cannot read {name}: {EXPECTED}")))?;
    if file.metadata().with_context(cannot)?.len() == 0 {
        return unreadable(format!("{name} is empty (0 bytes): {EXPECTED}; copy it again"));
    }
    let mut head = [0u8; 12];
    let n = file.read(&mut head).with_context(cannot)?;
    let is_mp4 = n == head.len() && &head[4..8] == b"ftyp";
    let truncated =
        || format!("{name} is truncated: the index (moov) of the mp4 is missing or broken; copy or download it again");
    let whitelists = [("format_whitelist", FORMATS), ("protocol_whitelist", "file")];
    let options = whitelists.iter().chain(options).copied().collect();
    let input = match ffmpeg::format::input_with_dictionary(&url(path)?, options) {
        Ok(input) => input,
        // This is the error for a container that `format_whitelist` rejects.
        Err(ffmpeg::Error::Other { errno: ffmpeg::error::EINVAL }) => {
            return unreadable(format!(
                "{name} has an unsupported format (a playlist or list of other files, or an unusual container): {EXPECTED}"
            ));
        }
        Err(ffmpeg::Error::InvalidData) if is_mp4 => return unreadable(truncated()),
        Err(ffmpeg::Error::InvalidData) => return unreadable(format!("{name} is not a media file: {EXPECTED}")),
        Err(error) => return unreadable(format!("cannot open {name} ({error}): {EXPECTED}")),
    };
    for stream in input.streams().filter(|stream| stream.parameters().medium() == ffmpeg::media::Type::Audio) {
        check_rate(path, audio_parameters(&stream)[0])?;
    }
    if video_stream(&input).is_some() || default_track(&input).is_some() {
        return Ok(input);
    }
    unreadable(if is_mp4 { truncated() } else { format!("{name} contains neither video nor audio: {EXPECTED}") })
}

/// `path` as a ffmpeg URL, marked as a file so that a colon in the name is not taken for a protocol.
pub(crate) fn url(path: &Path) -> Result<String> {
    let text = path.to_str().filter(|text| !text.contains('\0'));
    let text = text.with_context(|| format!("the file name {} is not UTF-8: rename the file", path.display()))?;
    Ok(format!("file:{text}"))
}

/// Video stream, if any; the cover image of an audio file does not count.
pub(crate) fn video_stream(input: &Input) -> Option<Stream<'_>> {
    let stream = input.streams().best(ffmpeg::media::Type::Video)?;
    (!stream.disposition().contains(Disposition::ATTACHED_PIC)).then_some(stream)
}

/// Audio streams in file order, except those without sample rate or channels.
fn audio_streams(input: &Input) -> Vec<Stream<'_>> {
    let is_sound = |stream: &Stream| {
        let is_complete = audio_parameters(stream).into_iter().all(|number| number > 0);
        stream.parameters().medium() == ffmpeg::media::Type::Audio && is_complete
    };
    input.streams().filter(is_sound).collect()
}

/// Sample rate and number of channels of an audio stream; 0 if unknown.
pub(crate) fn audio_parameters(stream: &Stream) -> [u32; 2] {
    // SAFETY: the parameters belong to `stream` and are only read here.
    let numbers = unsafe {
        let parameters = stream.parameters();
        let parameters = parameters.as_ptr();
        [(*parameters).sample_rate, (*parameters).ch_layout.nb_channels]
    };
    numbers.map(|number| u32::try_from(number).unwrap_or(0))
}

/// Errors if the sample rate is implausible; 0 is unknown and accepted.
pub(crate) fn check_rate(path: &Path, rate: u32) -> Result<()> {
    if rate == 0 || SAMPLE_RATES.contains(&rate) {
        return Ok(());
    }
    let (name, min, max) = (path.display(), SAMPLE_RATES.start(), SAMPLE_RATES.end());
    let problem = format!("invalid audio sample rate {rate} Hz in {name}: expected {min} to {max} Hz");
    Err(UnreadableMedia(problem).into())
}

/// Audio stream used by default: the first one that is marked as the default, or else the first.
pub(crate) fn default_track(input: &Input) -> Option<Stream<'_>> {
    let streams = audio_streams(input);
    let is_default = |stream: &Stream| stream.disposition().contains(Disposition::DEFAULT);
    let at = streams.iter().position(is_default).unwrap_or(0);
    streams.into_iter().nth(at)
}

/// Stream of audio track `track` (from 1; 0: the default track), with all available tracks; `None` without audio. A
/// file with a single track always uses it. Errors: the file has fewer tracks.
pub(crate) fn audio_track(input: &Input, track: usize) -> Result<Option<(Stream<'_>, AudioTracks)>> {
    let streams = audio_streams(input);
    let Some(default_stream) = default_track(input) else { return Ok(None) };
    let n_tracks = streams.len();
    let language =
        |stream: &Stream| stream.metadata().get("language").filter(|name| *name != "und").unwrap_or("").to_owned();
    let languages: Vec<String> = streams.iter().map(language).collect();
    let chosen = match track {
        0 => streams.iter().position(|stream| stream.index() == default_stream.index()).unwrap_or(0),
        _ if n_tracks == 1 => 0,
        track if track <= n_tracks => track - 1,
        track => bail!("no audio track {track}, the file has {n_tracks}: change extract.audio_track"),
    };
    let stream = streams.into_iter().nth(chosen);
    Ok(stream.map(|stream| (stream, AudioTracks { n_tracks, selected: chosen + 1, languages })))
}

/// Length in seconds as stated by the container for this stream, or else for the file.
pub(crate) fn stated_secs(input: &Input, stream: &Stream) -> Option<f64> {
    lengths(input, stream).into_iter().find(|secs| *secs > 0.0)
}

/// Latest plausible timestamp, seconds: one minute after every stated end, but at most a day.
pub(crate) fn latest_secs(input: &Input, stream: &Stream) -> f64 {
    let stated = lengths(input, stream).into_iter().fold(0.0, f64::max);
    if stated > 0.0 { MAX_SECS.min(stated + 60.0) } else { MAX_SECS }
}

/// Stated lengths of the stream and of the file, seconds; negative if unknown.
fn lengths(input: &Input, stream: &Stream) -> [f64; 2] {
    let own = stream.duration() as f64 * f64::from(stream.time_base());
    [own, input.duration() as f64 / f64::from(ffmpeg::ffi::AV_TIME_BASE)]
}
