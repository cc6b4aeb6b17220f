//! Copies an excerpt of a video to a file without re-encoding, so that stages treat it as they treat the video.

use crate::ffmpeg::source;
use anyhow::{Context, Result, ensure};
use ffmpeg_next::format::context::{Input, Output};
use ffmpeg_next::{Rational, codec, encoder, format};
use std::path::Path;

/// Copies about `secs` seconds of the video stream of `from`, starting at the key frame at or before `start_secs`,
/// and of the default audio track, into the Matroska file `to`. Returns the number of seconds copied.
///
/// # Errors
///
/// The file cannot be read, has no images, or has streams that Matroska does not support.
pub fn copy(from: &Path, to: &Path, start_secs: f64, secs: f64) -> Result<f64> {
    let mut input = source::open(from)?;
    let video = source::video_stream(&input).with_context(|| format!("{} has no video", from.display()))?.index();
    let sound = source::default_track(&input).map(|stream| stream.index());
    let what = || format!("cannot copy an excerpt of {}", from.display());
    if start_secs > 0.0 {
        let at = (start_secs * f64::from(ffmpeg_next::ffi::AV_TIME_BASE)) as i64;
        input.seek(at, ..at).with_context(what)?;
    }
    let mut output = format::output_as(&source::url(to)?, "matroska").with_context(what)?;
    let streams: Vec<usize> = [Some(video), sound].into_iter().flatten().collect();
    for index in &streams {
        add_stream(&mut output, &input, *index).with_context(what)?;
    }
    output.write_header().with_context(what)?;
    // The excerpt starts with the first key frame.
    let (mut first_secs, mut last_secs) = (None, 0.0f64);
    for (stream, mut packet) in input.packets() {
        let Some(to_stream) = streams.iter().position(|index| *index == stream.index()) else { continue };
        let tick = stream.time_base();
        let secs_at = |time: i64| time as f64 * f64::from(tick);
        let Some(time) = packet.dts().or(packet.pts()) else { continue };
        if first_secs.is_none() && stream.index() == video && packet.is_key() {
            first_secs = Some(secs_at(time));
        }
        let Some(first) = first_secs.filter(|first| secs_at(time) >= *first) else { continue };
        if stream.index() == video {
            if secs_at(time) >= first + secs {
                break;
            }
            last_secs = last_secs.max(secs_at(time + packet.duration().max(1)) - first);
        }
        let shifted = |time: Option<i64>| time.map(|time| time - (first / f64::from(tick)).round() as i64);
        packet.set_pts(shifted(packet.pts()));
        packet.set_dts(shifted(packet.dts()));
        let to_tick = output.stream(to_stream).map_or(Rational(1, 1000), |stream| stream.time_base());
        packet.rescale_ts(tick, to_tick);
        packet.set_position(-1);
        packet.set_stream(to_stream);
        packet.write_interleaved(&mut output).with_context(what)?;
    }
    ensure!(last_secs > 0.0, "{} has no images at {start_secs:.1} s", from.display());
    output.write_trailer().with_context(what)?;
    Ok(last_secs)
}

fn add_stream(output: &mut Output, input: &Input, index: usize) -> Result<()> {
    let from = input.stream(index).context("a stream is missing")?;
    let mut to = output.add_stream(encoder::find(codec::Id::None))?;
    to.set_parameters(from.parameters());
    // SAFETY: the parameters belong to the new stream; the codec tag is cleared as it belongs to the source container.
    unsafe { (*to.parameters().as_mut_ptr()).codec_tag = 0 };
    Ok(())
}
