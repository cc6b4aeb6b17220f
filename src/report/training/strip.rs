//! Picture of generated and true poses of held-out intervals: figures at a few moments, true above generated, and the
//! height of both wrists over time.

use anyhow::Result;
use ndarray::Axis;
use orator_avatar::animate::draw::figure::{FigureView, INK, LEFT, PAPER, RIGHT, draw_pose, mix};
use orator_base::types::image::Image;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_WRIST, R_WRIST};
use orator_media::opencv::draw;
use std::ops::Range;

/// Ground truth and generated motion of an interval, held out if possible, of equal rate and, up to rounding, length.
pub struct HeldOutPair {
    /// Split and key of the interval.
    pub name: String,
    /// Start within the interval, seconds.
    pub start_secs: f64,
    pub ground_truth: Motion,
    pub predicted: Motion,
}

const N_MOMENTS: usize = 8;
const EVERY_SECS: f64 = 0.5;
const CELL: [usize; 2] = [136, 150];
/// Width of the labels at the left, px.
const MARGIN: usize = 84;
/// Height of the name above a pair, px.
const NAME_PX: usize = 24;
const TRACK_PX: usize = 64;
/// Height of a pair, px: name, two rows of figures, and two tracks.
pub const PAIR_PX: usize = NAME_PX + 2 * CELL[1] + 2 * TRACK_PX + 14;
/// Minimum range of heights that a track shows, metres.
const TRACK_METRES: f32 = 0.15;

/// Width of the picture, px.
pub const WIDTH: usize = MARGIN + N_MOMENTS * CELL[0];

/// Draws the pairs one below the other.
pub fn strip(pairs: &[HeldOutPair]) -> Result<Image> {
    let mut image = Image::filled(WIDTH, (pairs.len() * PAIR_PX).max(1), PAPER);
    for (row, pair) in pairs.iter().enumerate() {
        draw_pair(&mut image, row * PAIR_PX, pair)?;
    }
    Ok(image)
}

fn draw_pair(image: &mut Image, top: usize, pair: &HeldOutPair) -> Result<()> {
    let fps = pair.ground_truth.fps;
    let n_frames = pair.ground_truth.n_frames().min(pair.predicted.n_frames());
    let span = ((N_MOMENTS as f64 * EVERY_SECS * fps.per_sec()).round() as usize).clamp(1, n_frames.max(1));
    // Take the middle, since intervals often start at rest.
    let first = n_frames.saturating_sub(span) / 2;
    let frame_of = |moment: usize| first + (2 * moment + 1) * span / (2 * N_MOMENTS);
    let title = format!("{}, from {:.1} s", pair.name, pair.start_secs + fps.secs(first));
    draw::text(image, &title, [8.0, top as f32 + 17.0], 10.0, INK)?;
    for (row, (name, motion)) in [("truth", &pair.ground_truth), ("generated", &pair.predicted)].into_iter().enumerate()
    {
        let row_top = top + NAME_PX + row * CELL[1];
        draw::text(image, name, [8.0, row_top as f32 + 62.0], 9.0, INK)?;
        for moment in (0..N_MOMENTS).filter(|moment| frame_of(*moment) < n_frames) {
            let mut cell = Image::filled(CELL[0], CELL[1], PAPER);
            let view = FigureView::front([CELL[0] as f32 / 2.0, 52.0], 104.0);
            draw_pose(&mut cell, motion.joints.index_axis(Axis(0), frame_of(moment)), &view)?;
            draw::paste(image, &cell, [MARGIN + moment * CELL[0], row_top]);
        }
    }
    for (track, (name, joint, rgb)) in
        [("right wrist", R_WRIST, RIGHT), ("left wrist", L_WRIST, LEFT)].into_iter().enumerate()
    {
        let track_top = (top + NAME_PX + 2 * CELL[1] + track * TRACK_PX) as f32;
        let [above, below] = range(pair, joint, first..(first + span).min(n_frames));
        let y = |metres: f32| {
            track_top + 6.0 + (TRACK_PX as f32 - 12.0) * ((metres - above) / (below - above)).clamp(0.0, 1.0)
        };
        let width = (N_MOMENTS * CELL[0]) as f32 - 8.0;
        let x = |frame: usize| MARGIN as f32 + width * (frame - first) as f32 / span as f32;
        draw::text(image, name, [8.0, track_top + 24.0], 8.0, rgb)?;
        draw::text(image, &format!("range {:.0} cm", 100.0 * (below - above)), [8.0, track_top + 40.0], 7.0, INK)?;
        for edge in [above, below] {
            draw::line(image, [x(first), y(edge)], [x(first) + width, y(edge)], 1.0, mix(INK, PAPER, 0.85))?;
        }
        for (motion, rgb, wide) in [(&pair.ground_truth, mix(INK, PAPER, 0.35), 2.0), (&pair.predicted, rgb, 2.0)] {
            for frame in first + 1..(first + span).min(n_frames) {
                let position = |frame: usize| [x(frame), y(motion.joints[[frame, joint, 1]])];
                draw::line(image, position(frame - 1), position(frame), wide, rgb)?;
            }
        }
    }
    Ok(())
}

/// Highest and lowest position of a wrist in either motion, metres below the neck, extended to at least `TRACK_METRES`.
fn range(pair: &HeldOutPair, joint: usize, frames: Range<usize>) -> [f32; 2] {
    let heights = [&pair.ground_truth, &pair.predicted].into_iter().flat_map(|motion| {
        frames.clone().map(|frame| motion.joints[[frame, joint, 1]]).filter(|height| height.is_finite())
    });
    let [above, below] =
        heights.fold([f32::INFINITY, f32::NEG_INFINITY], |[above, below], h| [above.min(h), below.max(h)]);
    if above > below {
        return [0.0, TRACK_METRES];
    }
    let more = (TRACK_METRES - (below - above)).max(0.0) / 2.0;
    [above - more, below + more]
}
