//! The ffmpeg libraries, and opening of a media file: its streams, or an error that names the file, the defect and what was
//! expected.

use anyhow::{Context, Result, bail};
use ffmpeg_next as ffmpeg;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::format::stream::{Disposition, Stream};
use orator_base::input;
use orator_base::types::sound::AudioTracks;
use std::io::Read;
use std::ops::RangeInclusive;
use std::path::Path;

/// Containers that hold all they need. ffmpeg opens others too: playlists and lists (hls, dash, concat, sdp, numbered
/// pictures) make it read whatever files they name.
const FORMATS: &str = "mov,matroska,webm,avi,mpegts,mpeg,mpegvideo,h264,hevc,flv,ogg,wav,w64,mp3,flac,aac,ac3,eac3,aiff,au,caf,amr,\
    asf,mxf,gif,jpeg_pipe,png_pipe";
/// Rates of sound that are believed, samples a second.
const SOUND_RATES: RangeInclusive<u32> = 4_000..=768_000;

const EXPECTED: &str = "expected a video or sound file (mp4, mov, mkv, webm, avi, wav, flac, mp3, ...)";

/// Starts ffmpeg once and silences its log lines, since every error is reported by this crate.
pub(crate) fn init() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        // Registers nothing since ffmpeg 4 and cannot fail there; a failure would show at the first file opened.
        let _ = ffmpeg::init();
        ffmpeg::log::set_level(ffmpeg::log::Level::Quiet);
    });
}

/// Versions of the ffmpeg libraries linked, for instance `libavformat 59.27.100, libavcodec 59.37.100, ...`.
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

/// A file that gives no picture or sound. The message names the file, what is wrong with it and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UnreadableMedia(pub String);

/// Longest plausible time between two frames, and duration of the last one, seconds. Longer gaps would be filled with
/// repeated pictures or silence.
pub(crate) const LONGEST_GAP_SECS: f64 = 600.0;
/// Longest plausible video or sound, seconds (a day).
pub const LONGEST_SECS: f64 = 86_400.0;

/// Opens `path` and reads its headers.
pub(crate) fn open(path: &Path) -> Result<Input> {
    open_with(path, &[])
}

/// Opens `path` with options for the container's reader. Every file of pictures or sound is opened here.
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
    let cut_short = || {
        format!(
            "{name} is cut short: it begins like an mp4 but its index (moov) is missing or broken; copy or download it again"
        )
    };
    let safe = [("format_whitelist", FORMATS), ("protocol_whitelist", "file")];
    let options = safe.iter().chain(options).copied().collect();
    let input = match ffmpeg::format::input_with_dictionary(&url(path)?, options) {
        Ok(input) => input,
        // So the list of formats refuses one.
        Err(ffmpeg::Error::Other { errno: ffmpeg::error::EINVAL }) => {
            return unreadable(format!(
                "{name} is of a kind that is not read (a playlist or list that names other files, or an unusual container): {EXPECTED}"
            ));
        }
        Err(ffmpeg::Error::InvalidData) if is_mp4 => return unreadable(cut_short()),
        Err(ffmpeg::Error::InvalidData) => return unreadable(format!("{name} is not a media file: {EXPECTED}")),
        Err(error) => return unreadable(format!("cannot open {name} ({error}): {EXPECTED}")),
    };
    for stream in input.streams().filter(|stream| stream.parameters().medium() == ffmpeg::media::Type::Audio) {
        check_rate(path, sound_numbers(&stream)[0])?;
    }
    if video_stream(&input).is_some() || automatic_track(&input).is_some() {
        return Ok(input);
    }
    unreadable(if is_mp4 { cut_short() } else { format!("{name} holds neither pictures nor sound: {EXPECTED}") })
}

/// `path` as ffmpeg wants it: text, and marked as a file so that a colon in its name is not taken for a protocol.
pub(crate) fn url(path: &Path) -> Result<String> {
    let text = path.to_str().filter(|text| !text.contains('\0'));
    let text = text.with_context(|| format!("the name {} is not UTF-8: rename the file", path.display()))?;
    Ok(format!("file:{text}"))
}

/// Stream of moving pictures, if any; the cover picture of a sound file is none.
pub(crate) fn video_stream(input: &Input) -> Option<Stream<'_>> {
    let stream = input.streams().best(ffmpeg::media::Type::Video)?;
    (!stream.disposition().contains(Disposition::ATTACHED_PIC)).then_some(stream)
}

/// Streams of sound in the order of the file, those without a rate or a channel left out.
fn audio_streams(input: &Input) -> Vec<Stream<'_>> {
    let is_sound = |stream: &Stream| {
        let is_whole = sound_numbers(stream).into_iter().all(|number| number > 0);
        stream.parameters().medium() == ffmpeg::media::Type::Audio && is_whole
    };
    input.streams().filter(is_sound).collect()
}

/// Samples a second and channels of a stream of sound; 0 where unknown.
pub(crate) fn sound_numbers(stream: &Stream) -> [u32; 2] {
    // SAFETY: the parameters belong to `stream` and are only read here.
    let numbers = unsafe {
        let parameters = stream.parameters();
        let parameters = parameters.as_ptr();
        [(*parameters).sample_rate, (*parameters).ch_layout.nb_channels]
    };
    numbers.map(|number| u32::try_from(number).unwrap_or(0))
}

/// Errors on a rate of sound that no recording has; 0 is unknown.
pub(crate) fn check_rate(path: &Path, rate: u32) -> Result<()> {
    if rate == 0 || SOUND_RATES.contains(&rate) {
        return Ok(());
    }
    let (name, least, most) = (path.display(), SOUND_RATES.start(), SOUND_RATES.end());
    let problem = format!("{name} says that its sound has {rate} samples a second, expected {least} to {most}");
    Err(UnreadableMedia(problem).into())
}

/// Stream of sound that is taken where nobody chose: the first one that is marked as the default, else the first.
pub(crate) fn automatic_track(input: &Input) -> Option<Stream<'_>> {
    let streams = audio_streams(input);
    let is_default = |stream: &Stream| stream.disposition().contains(Disposition::DEFAULT);
    let at = streams.iter().position(is_default).unwrap_or(0);
    streams.into_iter().nth(at)
}

/// Stream of the sound track `track`, from 1 (0: the automatic one), with what it was chosen from; `None` without sound.
/// A file with one track has no choice. Errors: fewer tracks.
pub(crate) fn audio_track(input: &Input, track: usize) -> Result<Option<(Stream<'_>, AudioTracks)>> {
    let streams = audio_streams(input);
    let Some(automatic) = automatic_track(input) else { return Ok(None) };
    let n_tracks = streams.len();
    let language =
        |stream: &Stream| stream.metadata().get("language").filter(|name| *name != "und").unwrap_or("").to_owned();
    let languages: Vec<String> = streams.iter().map(language).collect();
    let chosen = match track {
        0 => streams.iter().position(|stream| stream.index() == automatic.index()).unwrap_or(0),
        _ if n_tracks == 1 => 0,
        track if track <= n_tracks => track - 1,
        track => bail!("there is no sound track {track}, the file has {n_tracks}: change extract.audio_track"),
    };
    let stream = streams.into_iter().nth(chosen);
    Ok(stream.map(|stream| (stream, AudioTracks { n_tracks, taken: chosen + 1, languages })))
}

/// Length in seconds as the container states it for this stream, or else for the whole file.
pub(crate) fn stated_secs(input: &Input, stream: &Stream) -> Option<f64> {
    lengths(input, stream).into_iter().find(|secs| *secs > 0.0)
}

/// Latest plausible timestamp, seconds: a minute past every stated end, a day at most.
pub(crate) fn latest_secs(input: &Input, stream: &Stream) -> f64 {
    let stated = lengths(input, stream).into_iter().fold(0.0, f64::max);
    if stated > 0.0 { LONGEST_SECS.min(stated + 60.0) } else { LONGEST_SECS }
}

/// The stream's length and the file's, in seconds; negative where unknown.
fn lengths(input: &Input, stream: &Stream) -> [f64; 2] {
    let own = stream.duration() as f64 * f64::from(stream.time_base());
    [own, input.duration() as f64 / f64::from(ffmpeg::ffi::AV_TIME_BASE)]
}
