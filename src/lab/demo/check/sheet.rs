//! Contact sheet of the demo: for a few frames the image, its keypoints, the 3D figure from the front and from the
//! left, and a frame of generated motion.

use anyhow::{Context, Result, ensure};
use ndarray::{ArrayView2, Axis};
use orator_avatar::animate::draw::figure::{FigureView, INK, PAPER, draw_pose};
use orator_avatar::animate::draw::overlay::{ImageTransform, draw_keypoints};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::types::image::Image;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::pose3d::Motion;
use orator_formats::{joints_npz, keypoints_npz};
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::opencv::{draw, warp};
use std::path::Path;

/// Size of a cell, height of the title line and margin of the rows, px.
const CELL: [usize; 2] = [320, 240];
const HEAD_PX: usize = 40;
const N_ROWS: usize = 3;
const COLUMNS: [&str; 5] = ["video", "2D keypoints", "3D, front", "3D, left", "generated motion"];

/// Draws the sheet of the video `unit` of a run in the folder `work`, with `generated` motion if given.
///
/// # Errors
/// A file that cannot be read; no frame with a pose.
pub fn draw_sheet(work: &Path, unit: &Unit, generated: Option<&Motion>) -> Result<Image> {
    let keypoints = keypoints_npz::read(&Artifact::Keypoints.path(work, unit))?;
    let lifted = Artifact::Joints.path(work, unit);
    let motion = joints_npz::read(&lifted)?;
    let moments = moments(&motion);
    ensure!(!moments.is_empty(), "no frame of {} has a complete pose", lifted.display());
    let width = COLUMNS.len() * CELL[0];
    let mut sheet = Image::filled(width, HEAD_PX + N_ROWS * CELL[1], PAPER);
    for (column, words) in COLUMNS.iter().enumerate() {
        if column < 4 || generated.is_some() {
            draw::text(&mut sheet, words, [(column * CELL[0] + 12) as f32, 26.0], 11.0, INK)?;
        }
    }
    let mut row = 0;
    for frame in FrameReader::open(&unit.source, keypoints.fps)? {
        let frame = frame?;
        if moments.get(row) != Some(&frame.frame_idx) {
            if row == moments.len() {
                break;
            }
            continue;
        }
        let joints = motion.joints.index_axis(Axis(0), frame.frame_idx);
        let secs = format!("{:.1} s", keypoints.fps.secs(frame.frame_idx));
        let mut cells = vec![small(&frame.image)?, overlay(&frame.image, &keypoints, frame.frame_idx)?];
        cells.extend([figure(joints, 0.0)?, figure(joints, 90.0)?]);
        if let Some(generated) = generated {
            let frame_idx = (row + 1) * generated.n_frames() / (N_ROWS + 1);
            let mut cell = figure(generated.joints.index_axis(Axis(0), frame_idx), 0.0)?;
            let secs = format!("{:.1} s", generated.fps.secs(frame_idx));
            draw::text(&mut cell, &secs, [12.0, 228.0], 10.0, INK)?;
            cells.push(cell);
        }
        draw::text(&mut cells[0], &secs, [12.0, 228.0], 10.0, INK)?;
        for (column, cell) in cells.iter().enumerate() {
            draw::paste(&mut sheet, cell, [column * CELL[0], HEAD_PX + row * CELL[1]]);
        }
        row += 1;
    }
    Ok(sheet)
}

/// Frames spread evenly over those with a complete pose.
fn moments(motion: &Motion) -> Vec<usize> {
    let is_complete = |frame: &ArrayView2<f32>| frame.iter().all(|v| v.is_finite());
    let frames: Vec<usize> =
        motion.joints.outer_iter().enumerate().filter(|(_, frame)| is_complete(frame)).map(|(n, _)| n).collect();
    let mut moments: Vec<usize> =
        (0..N_ROWS).filter_map(|k| frames.get((2 * k + 1) * frames.len() / (2 * N_ROWS)).copied()).collect();
    moments.dedup();
    moments
}

fn small(image: &Image) -> Result<Image> {
    let mut cell = Image::filled(CELL[0], CELL[1], PAPER);
    warp::resize(image, &mut cell).context("cannot scale a frame")?;
    Ok(cell)
}

/// The lightened frame with its keypoints drawn over it.
fn overlay(image: &Image, keypoints: &Keypoints, frame_idx: usize) -> Result<Image> {
    let mut cell = small(image)?;
    for (value, paper) in cell.data.iter_mut().zip(PAPER.iter().cycle()) {
        *value = ((u16::from(*value) + u16::from(*paper)) / 2) as u8;
    }
    let scale = [CELL[0] as f32 / image.width as f32, CELL[1] as f32 / image.height as f32];
    draw_keypoints(&mut cell, keypoints, frame_idx, ImageTransform { scale, shift: [0.0; 2] }, 2.0)?;
    Ok(cell)
}

fn figure(joints: ArrayView2<f32>, yaw_degrees: f32) -> Result<Image> {
    let mut cell = Image::filled(CELL[0], CELL[1], PAPER);
    let view = FigureView { yaw_degrees, ..FigureView::front([CELL[0] as f32 / 2.0, 92.0], 215.0) };
    draw_pose(&mut cell, joints, &view)?;
    Ok(cell)
}
