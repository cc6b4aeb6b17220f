//! 2D keypoints drawn over the image in which they were detected, left and right in their colours. Missing points, and
//! bones that end in them, are not drawn.

use super::figure::{INK, LEFT, RIGHT};
use anyhow::Result;
use ndarray::{ArrayView2, Axis};
use orator_base::math::order::Ordered;
use orator_base::types::image::Image;
use orator_base::types::pose2d::{Keypoints, N_HAND, VISIBLE_SCORE};
use orator_media::opencv::draw;

/// COCO-17 bones that are drawn, as pairs of keypoints.
const BONES: [(usize, usize); 10] =
    [(5, 6), (5, 7), (7, 9), (6, 8), (8, 10), (5, 11), (6, 12), (11, 12), (0, 1), (0, 2)];

/// Transform of video pixels into the target image: `scale * px + shift`, per axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageTransform {
    pub scale: [f32; 2],
    pub shift: [f32; 2],
}

/// Draws the keypoints of one frame, with bones `width_px` wide (fingers half of it).
pub fn draw_keypoints(
    image: &mut Image,
    keypoints: &Keypoints,
    frame_idx: usize,
    place: ImageTransform,
    width_px: f32,
) -> Result<()> {
    let at = |points: ArrayView2<f32>, point: usize| -> Option<[f32; 2]> {
        let found = points[[point, 2]] > VISIBLE_SCORE;
        found.then(|| [0, 1].map(|axis| points[[point, axis]] * place.scale[axis] + place.shift[axis]))
    };
    let body = keypoints.body.index_axis(Axis(0), frame_idx);
    for (from, to) in BONES {
        let rgb = match (from, to) {
            (0, _) => INK,
            _ if from % 2 != to % 2 => INK,
            _ if from % 2 == 1 => LEFT,
            _ => RIGHT,
        };
        if let (Some(from), Some(to)) = (at(body, from), at(body, to)) {
            draw::line(image, from, to, width_px, rgb)?;
            draw::circle(image, to, 1.25 * width_px, rgb)?;
        }
    }
    for (hand, rgb) in [(&keypoints.left_hand, LEFT), (&keypoints.right_hand, RIGHT)] {
        let points = hand.index_axis(Axis(0), frame_idx);
        for point in 1..N_HAND {
            let base = if point % 4 == 1 { 0 } else { point - 1 };
            if let (Some(from), Some(to)) = (at(points, base), at(points, point)) {
                draw::line(image, from, to, width_px / 2.0, rgb)?;
            }
        }
    }
    Ok(())
}

/// Bounding box of the upper body and the hands over the complete clip, without each point's outermost positions (one
/// frame in fifty on each side): left, top, right, bottom in px; `None` if nothing was detected.
pub fn extent(keypoints: &Keypoints) -> Option<[f32; 4]> {
    const N_UPPER: usize = 11;
    let mut extent: Option<[f32; 4]> = None;
    let arrays = [(&keypoints.body, N_UPPER), (&keypoints.left_hand, N_HAND), (&keypoints.right_hand, N_HAND)];
    for (points, point) in arrays.into_iter().flat_map(|(points, n)| (0..n).map(move |point| (points, point))) {
        let found = points.outer_iter().filter(|frame| frame[[point, 2]] > VISIBLE_SCORE);
        let ends = |axis: usize| {
            let places = Ordered::new(found.clone().map(|frame| frame[[point, axis]]));
            Some([places.low_end(50)?, places.high_end(50)?])
        };
        let (Some([left, right]), Some([top, bottom])) = (ends(0), ends(1)) else { continue };
        let [l, t, r, b] = extent.unwrap_or([left, top, right, bottom]);
        extent = Some([l.min(left), t.min(top), r.max(right), b.max(bottom)]);
    }
    extent
}
