//! Thumbnails of the chosen moments: small video frames overlaid with their keypoints. A video is read once, up to its
//! last moment. Keypoints of other programs are drawn on an empty picture.

use super::worst::Worst;
use anyhow::{Context, Result, ensure};
use orator_avatar::animate::draw::overlay;
use orator_avatar::animate::draw::overlay::ImageTransform;
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::types::image::Image;
use orator_base::types::pose2d::Keypoints;
use orator_formats::keypoints_npz;
use orator_formats::media_json::MediaInfo;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::jpeg;
use orator_media::opencv::draw;
use orator_pipeline::extract::picture_options;
use std::collections::BTreeMap;
use std::path::Path;

/// Maximum width and height of a thumbnail, px.
const MAX_PX: [f64; 2] = [400.0, 260.0];
const GAP_PX: usize = 4;
const GAP_RGB: [u8; 3] = [255; 3];
const EMPTY_RGB: [u8; 3] = [70; 3];

/// Thumbnail of a moment.
#[derive(Clone, Debug)]
pub struct MomentThumbnail {
    pub jpeg: Vec<u8>,
    pub size: [usize; 2],
}

/// Pictures of the video with index `video`, by the frames of their moments.
///
/// # Errors
/// Unreadable keypoints or video, or one that ends before a chosen frame.
pub fn thumbnails(
    work: &Path,
    unit: &Unit,
    video: usize,
    worst: &Worst,
) -> Result<BTreeMap<Vec<usize>, MomentThumbnail>> {
    let keypoints = keypoints_npz::read(&Artifact::Keypoints.path(work, unit))?;
    let moments: Vec<&Vec<usize>> =
        worst.rules.values().flatten().filter(|m| m.video == video).map(|m| &m.frames).collect();
    let frames = worst.frames_of(video);
    let media = MediaInfo::read(&Artifact::MediaInfo.path(work, unit)).ok();
    let has_pictures = media.is_none_or(|media| media.keypoints_from.is_none());
    let open = || -> Result<FrameReader> {
        Ok(FrameReader::open_with(&unit.source, keypoints.fps, 0)?.with_options(picture_options(work, unit)))
    };
    let mut reader = has_pictures.then(open).transpose()?;
    let n_wide = |frame: &usize| if moments.iter().any(|m| m.len() > 1 && m.contains(frame)) { 2 } else { 1 };
    let mut thumbnails_by_frame = BTreeMap::new();
    for frame_idx in &frames {
        ensure!(
            *frame_idx < keypoints.n_frames(),
            "the keypoints have {} frames, frame {frame_idx} is missing",
            keypoints.n_frames()
        );
        while let Some(reader) = &mut reader {
            let time = reader.advance()?.with_context(|| {
                format!(
                    "{} ends before frame {frame_idx}: the file has changed since it was processed",
                    unit.source.display()
                )
            })?;
            if time.frame_idx == *frame_idx {
                break;
            }
        }
        thumbnails_by_frame
            .insert(*frame_idx, draw_thumbnail(reader.as_mut(), &keypoints, *frame_idx, n_wide(frame_idx))?);
    }
    let picture = |frames: &Vec<usize>| -> Result<MomentThumbnail> {
        let image = side_by_side(frames.iter().filter_map(|frame| thumbnails_by_frame.get(frame)));
        Ok(MomentThumbnail { size: [image.width, image.height], jpeg: jpeg::encode(&image)? })
    };
    moments.into_iter().map(|frames| Ok((frames.clone(), picture(frames)?))).collect()
}

/// Current frame of the reader, or an empty picture, overlaid with its keypoints; `n_wide` thumbnails share the maximum
/// width.
fn draw_thumbnail(
    reader: Option<&mut FrameReader>,
    keypoints: &Keypoints,
    frame_idx: usize,
    n_wide: usize,
) -> Result<Image> {
    let size = reader.as_ref().map_or(keypoints.image_size.map(|px| px as usize), |reader| reader.image_size());
    let frame_size = size.map(|px| px.max(1) as f64);
    let scale = (MAX_PX[0] / n_wide as f64 / frame_size[0]).min(MAX_PX[1] / frame_size[1]).min(1.0);
    let small = frame_size.map(|px| ((px * scale).round() as usize).max(2));
    let mut image = match reader {
        Some(reader) => reader.picture(Some(small))?,
        None => Image::filled(small[0], small[1], EMPTY_RGB),
    };
    let scale = [0, 1].map(|axis| small[axis] as f32 / keypoints.image_size[axis].max(1) as f32);
    overlay::draw_keypoints(&mut image, keypoints, frame_idx, ImageTransform { scale, shift: [0.0; 2] }, 2.0)?;
    Ok(image)
}

fn side_by_side<'a>(images: impl Iterator<Item = &'a Image> + Clone) -> Image {
    let width: usize = images.clone().map(|image| image.width + GAP_PX).sum();
    let height = images.clone().map(|image| image.height).max().unwrap_or(1);
    let mut all = Image::filled(width.saturating_sub(GAP_PX).max(1), height, GAP_RGB);
    let mut left = 0;
    for image in images {
        draw::paste(&mut all, image, [left, 0]);
        left += image.width + GAP_PX;
    }
    all
}
