//! Cells of a contact sheet: the video frame overlaid with its keypoints, and the 3D pose at constant scale on a
//! decimetre grid, from the front or from the left.

use anyhow::{Context, Result};
use ndarray::ArrayView2;
use orator_avatar::animate::draw::figure::{FigureView, INK, PAPER, draw_pose, mix};
use orator_avatar::animate::draw::overlay::{self, ImageTransform};
use orator_base::types::image::Image;
use orator_base::types::pose2d::Keypoints;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::opencv::{draw, warp};

/// Width and height of a cell, px.
pub const CELL_PX: usize = 340;
/// Scale of the 3D cells.
const PX_PER_METRE: f32 = 270.0;
/// Position of the neck in the 3D cells, px.
const NECK_PX: [f32; 2] = [CELL_PX as f32 / 2.0, 125.0];
/// Side of the crop relative to the extent of the keypoints.
const MARGIN: f32 = 1.15;
const MAX_MAGNIFICATION: f32 = 4.0;

/// Square crop of the video that all frame cells of a clip show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetCrop {
    /// Size of the complete frame after scaling, px.
    scaled: [usize; 2],
    transform: ImageTransform,
}

impl SheetCrop {
    /// Square around all keypoints of the clip, in a frame of `image_size` px; the complete frame if there are none.
    pub fn around(keypoints: &Keypoints, image_size: [usize; 2]) -> Self {
        let frame_size = image_size.map(|px| px as f32);
        let found = overlay::extent(keypoints).unwrap_or([0.0, 0.0, frame_size[0], frame_size[1]]);
        let [left, top, right, bottom] = found;
        let side = (MARGIN * (right - left).max(bottom - top)).clamp(16.0, frame_size[0].max(frame_size[1]) * MARGIN);
        let scale = (CELL_PX as f32 / side).min(MAX_MAGNIFICATION);
        let scaled = frame_size.map(|px| ((px * scale).round() as usize).clamp(1, 8 * CELL_PX));
        let scale = [0, 1].map(|axis| scaled[axis] as f32 / frame_size[axis]);
        let middle = [(left + right) / 2.0, (top + bottom) / 2.0];
        let shift = [0, 1].map(|axis| CELL_PX as f32 / 2.0 - scale[axis] * middle[axis].clamp(0.0, frame_size[axis]));
        Self { scaled, transform: ImageTransform { scale, shift: shift.map(f32::round) } }
    }

    /// Current frame of the reader, cropped and overlaid with its keypoints.
    pub fn cell(&self, reader: &mut FrameReader, keypoints: &Keypoints, frame_idx: usize) -> Result<Image> {
        let picture = reader.picture(Some(self.scaled))?;
        let mut cell = Image::filled(CELL_PX, CELL_PX, PAPER);
        let shift = self.transform.shift.map(f64::from);
        let src_from_dst = warp::SrcFromDst([[1.0, 0.0, -shift[0]], [0.0, 1.0, -shift[1]]]);
        warp::warp(&picture, &src_from_dst, &mut cell).context("cannot crop a video frame")?;
        overlay::draw_keypoints(&mut cell, keypoints, frame_idx, self.transform, 3.0)?;
        Ok(cell)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellView {
    Front,
    /// From the speaker's left: forward is to the left of the cell.
    Left,
}

/// Pose [49, 3] on the grid, in orthographic projection.
pub fn pose_cell(joints: ArrayView2<f32>, from: CellView) -> Result<Image> {
    let mut cell = Image::filled(CELL_PX, CELL_PX, PAPER);
    let view = FigureView {
        yaw_degrees: if from == CellView::Left { 90.0 } else { 0.0 },
        camera_metres: f32::INFINITY,
        trunk: 0.0,
        ..FigureView::front(NECK_PX, PX_PER_METRE)
    };
    draw_grid(&mut cell)?;
    draw_head(&mut cell, from)?;
    draw_pose(&mut cell, joints, &view)?;
    let label = match from {
        CellView::Front => "front; axes in metres",
        CellView::Left => "from the speaker's left   <-- front",
    };
    draw::text(&mut cell, label, [6.0, 16.0], 9.0, INK)?;
    Ok(cell)
}

/// Draws grid lines every 0.1 m, stronger ones every 0.5 m and the strongest through the neck.
fn draw_grid(cell: &mut Image) -> Result<()> {
    let end = CELL_PX as f32;
    for decimetre in -15..=15_i32 {
        let rgb = match decimetre {
            0 => mix(INK, PAPER, 0.3),
            _ if decimetre % 5 == 0 => mix(INK, PAPER, 0.65),
            _ => mix(INK, PAPER, 0.88),
        };
        let at = NECK_PX.map(|px| (px + decimetre as f32 * 0.1 * PX_PER_METRE).round());
        draw::line(cell, [at[0], 0.0], [at[0], end], 1.0, rgb)?;
        draw::line(cell, [0.0, at[1]], [end, at[1]], 1.0, rgb)?;
        if decimetre % 5 == 0 && (0.0..end).contains(&at[0]) {
            let label = format!("{:.1}", f64::from(decimetre) / 10.0);
            draw::text(cell, &label, [at[0] + 3.0, end - 4.0], 8.0, mix(INK, PAPER, 0.3))?;
        }
    }
    Ok(())
}

/// Draws the outline of a head above the neck, always upright since the pose has no head joints.
fn draw_head(cell: &mut Image, from: CellView) -> Result<()> {
    let rgb = mix(INK, PAPER, 0.6);
    let at = |across: f32, down: f32| [NECK_PX[0] + across * PX_PER_METRE, NECK_PX[1] + down * PX_PER_METRE];
    let ahead = if from == CellView::Left { -1.0 } else { 0.0 };
    draw::circle_outline(cell, at(0.03 * ahead, -0.20), 0.10 * PX_PER_METRE, 1.0, rgb)?;
    draw::circle(cell, at(0.13 * ahead, -0.19), 0.015 * PX_PER_METRE, rgb)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, Array3, s};
    use orator_avatar::animate::draw::figure::{LEFT, RIGHT};
    use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, N_JOINTS};
    use orator_base::types::time::FrameRate;

    #[test]
    fn forward_is_left_in_the_side_view_and_the_left_arm_has_its_colour() {
        let mut joints = Array2::from_elem((N_JOINTS, 3), f32::NAN);
        joints.row_mut(0).fill(0.0);
        for (joint, place) in
            [(L_SHOULDER, [0.17, 0.0, 0.0]), (L_ELBOW, [0.17, 0.3, 0.0]), (L_WRIST, [0.17, 0.3, -0.4])]
        {
            joints.slice_mut(s![joint, ..]).assign(&ndarray::arr1(&place));
        }
        let cell = pose_cell(joints.view(), CellView::Left).unwrap();
        let teal = |x: usize, y: usize| {
            let [r, g, b] = cell.pixel(x, y).map(i32::from);
            b > r + 40 && g > r + 20
        };
        let (elbow_y, elbow_x) = ((125.0 + 0.3 * PX_PER_METRE) as usize, 170);
        assert!(teal(elbow_x - 60, elbow_y) && !teal(elbow_x + 60, elbow_y));
        assert!(LEFT[2] > LEFT[0] && RIGHT[0] > RIGHT[2]);
    }

    #[test]
    fn the_crop_contains_all_keypoints() {
        let mut body = Array3::zeros((10, 17, 3));
        for t in 0..10 {
            body.slice_mut(s![t, 5, ..]).assign(&ndarray::arr1(&[800.0, 300.0, 1.0]));
            body.slice_mut(s![t, 6, ..]).assign(&ndarray::arr1(&[600.0, 400.0, 1.0]));
        }
        let hand = Array3::zeros((10, 21, 3));
        let (fps, image_size) = (FrameRate::new(15, 1), [1280, 720]);
        let keypoints =
            Keypoints { fps, image_size, body, left_hand: hand.clone(), right_hand: hand, hand_depth: None };
        let ImageTransform { scale, shift } = SheetCrop::around(&keypoints, [1280, 720]).transform;
        let at = |x: f32, y: f32| [scale[0] * x + shift[0], scale[1] * y + shift[1]];
        assert!((at(700.0, 350.0)[0] - 170.0).abs() < 1.0 && (at(700.0, 350.0)[1] - 170.0).abs() < 1.0);
        assert!((20.0..30.0).contains(&at(600.0, 350.0)[0]));
        let nothing = Keypoints { body: Array3::zeros((10, 17, 3)), ..keypoints };
        assert!(SheetCrop::around(&nothing, [1280, 720]).transform.scale[0] < 0.3);
    }
}
