//! One pass over the pictures of a video: thumbnails for shots and movement and, in the first pass, a survey.

use super::shots::{RESTART, ShotFinder};
use super::survey::PictureSurvey;
use super::thumbnail::{THUMBNAIL, mean_change};
use anyhow::{Context, Result};
use orator_base::stage::progress::Progress;
use orator_base::types::image::{Image, PixelArea};
use orator_base::types::time::FrameRate;
use orator_formats::timeline_npz::Timeline;
use orator_media::ffmpeg::frames::{FrameReader, Resize};
use orator_media::opencv::png;
use std::fs;
use std::hash::{DefaultHasher, Hasher as _};
use std::path::Path;

pub struct PictureReading {
    /// Timeline with a single span.
    pub timeline: Timeline,
    /// Number of changes of the picture size.
    pub n_resizes: usize,
    /// Checksum of each frame's thumbnail.
    pub checksums: Vec<u64>,
}

/// Reads all pictures once. Each is reduced to a thumbnail of `area` (of the full picture if `None`), unless the
/// survey wants the full picture. Tracking restarts where the size changes; a shot begins where the aspect ratio
/// changes, and where another recording begins in a file of joined recordings.
pub fn read(
    reader: &mut FrameReader,
    rate: FrameRate,
    area: Option<PixelArea>,
    mut survey: Option<&mut PictureSurvey>,
    progress: &dyn Progress,
) -> Result<PictureReading> {
    let (mut timeline, mut n_resizes) = (Timeline::default(), 0);
    let (mut shots, mut previous) = (ShotFinder::new(rate), None);
    let (mut resizes, mut cuts, mut checksums) = (Vec::new(), Vec::new(), Vec::new());
    let task = progress.begin("frames", reader.expected_frames().unwrap_or(0) as u64);
    while let Some(time) = reader.advance()? {
        timeline.source_secs.push(time.source_secs);
        timeline.repeated.push(time.repeated);
        let picture = if time.repeated { None } else { Some(thumbnail(reader, area)?) };
        if let (Some(survey), false) = (survey.as_deref_mut(), time.repeated) {
            let full_picture = survey.needs_picture().then(|| reader.picture(None)).transpose()?;
            survey.push(full_picture, reader.is_flagged_interlaced());
        }
        checksums.push(picture.as_ref().map_or_else(|| checksums.last().copied().unwrap_or(0), checksum));
        shots.push(picture.clone());
        let pair = previous.as_ref().zip(picture.as_ref());
        timeline.frame_difference.push(pair.map_or(0.0, |(a, b)| mean_change(a, b)));
        previous = picture.or(previous);
        n_resizes += usize::from(time.resize != Resize::None);
        resizes.push(time.resize);
        cuts.push(time.is_join || time.resize == Resize::Reshaped);
        task.advance(1);
    }
    timeline.shot_score = shots.finish();
    for (score, is_cut) in timeline.shot_score.iter_mut().zip(cuts) {
        *score = if is_cut { 1.0 } else { *score };
    }
    let frames = timeline.shot_score.iter().zip(&resizes);
    timeline.restart = frames.map(|(score, resize)| *score >= RESTART || *resize != Resize::None).collect();
    timeline.span = vec![false; timeline.n_frames()];
    Ok(PictureReading { timeline, n_resizes, checksums })
}

/// Checksum of the pixels of a picture.
pub fn checksum(picture: &Image) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(&picture.data);
    hasher.finish()
}

/// Thumbnail of `area`: the full picture is scaled so that the area has thumbnail size.
pub fn thumbnail(reader: &mut FrameReader, area: Option<PixelArea>) -> Result<Image> {
    let Some(area) = area else { return reader.picture(Some(THUMBNAIL)) };
    let scales = [(0, area.width), (1, area.height)].map(|(axis, px)| THUMBNAIL[axis] as f64 / px.max(1) as f64);
    let full_size = reader.image_size();
    let scaled = |px: usize, axis: usize| (px as f64 * scales[axis]).round() as usize;
    let size = [0, 1].map(|axis| scaled(full_size[axis], axis).max(THUMBNAIL[axis]));
    let corner = [scaled(area.x, 0), scaled(area.y, 1)];
    let [x, y] = [0, 1].map(|axis| corner[axis].min(size[axis] - THUMBNAIL[axis]));
    let [width, height] = THUMBNAIL;
    Ok(reader.picture(Some(size))?.cropped(PixelArea { x, y, width, height }))
}

/// Writes every picture as PNG into `folder`, which is created.
pub fn write_pictures(reader: &mut FrameReader, folder: &Path, progress: &dyn Progress) -> Result<()> {
    fs::create_dir(folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    let task = progress.begin("pictures", reader.expected_frames().unwrap_or(0) as u64);
    while let Some(time) = reader.advance()? {
        png::write(&folder.join(format!("{:06}.png", time.frame_idx)), &reader.picture(None)?)?;
        task.advance(1);
    }
    Ok(())
}
