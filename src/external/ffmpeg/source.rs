//! Opening of a media file: its streams, or an error that names the file, the defect and what was expected.

use crate::types::sound::AudioTracks;
use anyhow::{Context, Result, bail};
use ffmpeg_next as ffmpeg;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::format::stream::{Disposition, Stream};
use std::io::Read;
use std::path::Path;

const EXPECTED: &str = "expected a video or sound file (mp4, mov, mkv, webm, avi, wav, flac, mp3, ...)";

/// A file that gives no picture or sound. The message names the file, what is wrong with it and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UnreadableMedia(pub String);

/// Longest plausible time between two frames, and duration of the last one, seconds. Longer gaps would be filled with
/// repeated pictures or silence.
pub(crate) const LONGEST_GAP_SECS: f64 = 600.0;
/// Longest plausible video or sound, seconds (a day).
pub(crate) const LONGEST_SECS: f64 = 86_400.0;

/// Opens `path` and reads its headers.
pub(crate) fn open(path: &Path) -> Result<Input> {
    open_with(path, &[])
}

/// Opens `path` with options for the container's reader.
pub(crate) fn open_with(path: &Path, options: &[(&str, &str)]) -> Result<Input> {
    super::library::init();
    let name = path.display();
    let cannot = || UnreadableMedia(format!("cannot read {name}"));
    let mut file =
        std::fs::File::open(path).with_context(|| UnreadableMedia(format!("cannot read {name}: {EXPECTED}")))?;
    let size = file.metadata().with_context(cannot)?;
    let unreadable = |problem: String| Err(UnreadableMedia(problem).into());
    if size.is_dir() {
        return unreadable(format!("{name} is a folder: {EXPECTED}"));
    }
    if size.is_file() && size.len() == 0 {
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
    let input = match ffmpeg::format::input_with_dictionary(&url(path)?, options.iter().copied().collect()) {
        Ok(input) => input,
        Err(ffmpeg::Error::InvalidData) if is_mp4 => return unreadable(cut_short()),
        Err(ffmpeg::Error::InvalidData) => return unreadable(format!("{name} is not a media file: {EXPECTED}")),
        Err(error) => return unreadable(format!("cannot open {name} ({error}): {EXPECTED}")),
    };
    match video_stream(&input).is_none() && automatic_track(&input).is_none() {
        false => Ok(input),
        true if is_mp4 => unreadable(cut_short()),
        true => unreadable(format!("{name} holds neither pictures nor sound: {EXPECTED}")),
    }
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
        // SAFETY: the parameters belong to `stream` and are only read here.
        let [rate, n_channels] = unsafe {
            let parameters = stream.parameters();
            let parameters = parameters.as_ptr();
            [(*parameters).sample_rate, (*parameters).ch_layout.nb_channels]
        };
        stream.parameters().medium() == ffmpeg::media::Type::Audio && rate > 0 && n_channels > 0
    };
    input.streams().filter(is_sound).collect()
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
