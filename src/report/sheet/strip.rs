//! Chart below a contact sheet: height and depth of both wrists over time; filled-in frames are paler than visible
//! ones.

use anyhow::Result;
use orator_avatar::animate::draw::figure::{INK, LEFT, PAPER, RIGHT, mix};
use orator_base::types::image::Image;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_WRIST, R_WRIST};
use orator_media::opencv::draw;
use std::ops::Range;

/// Height of the chart, px.
pub const STRIP_PX: usize = 260;
/// Width of the labels at the left, px.
const MARGIN_PX: f32 = 60.0;
/// Tracks of the chart: axis, range from top to bottom in metres, and label.
const TRACKS: [(usize, [f32; 2], &str); 2] = [(1, [-0.3, 0.7], "height"), (2, [-0.7, 0.1], "depth")];

/// Draws the wrists over `frames` in the pixel rows from `top` on, with a vertical line at each frame in `marks`.
pub fn draw_strip(image: &mut Image, top: usize, motion: &Motion, frames: Range<usize>, marks: &[usize]) -> Result<()> {
    let track_px = (STRIP_PX as f32 - 30.0) / TRACKS.len() as f32;
    let (left, right) = (MARGIN_PX, image.width as f32 - 10.0);
    let n_steps = frames.len().saturating_sub(1).max(1) as f32;
    let x_of = |t: usize| left + (right - left) * t.saturating_sub(frames.start) as f32 / n_steps;
    for (track, (axis, [above, below], label)) in TRACKS.into_iter().enumerate() {
        let (start, end) =
            (top as f32 + track as f32 * track_px + 4.0, top as f32 + (track + 1) as f32 * track_px - 4.0);
        let y_of = |metres: f32| start + (end - start) * ((metres - above) / (below - above)).clamp(0.0, 1.0);
        for decimetre in (above * 10.0).round() as i32..=(below * 10.0).round() as i32 {
            let metres = decimetre as f32 / 10.0;
            let paper_share = if decimetre == 0 { 0.3 } else { 0.85 };
            draw::line(image, [left, y_of(metres)], [right, y_of(metres)], 1.0, mix(INK, PAPER, paper_share))?;
        }
        draw::text(image, label, [6.0, start + 14.0], 9.0, INK)?;
        let [first, last] = [above, below].map(|metres| format!("{:+.1} m", if axis == 1 { -metres } else { metres }));
        draw::text(image, &first, [6.0, start + 32.0], 8.0, INK)?;
        draw::text(image, &last, [6.0, end], 8.0, INK)?;
        for &mark in marks {
            draw::line(image, [x_of(mark), start], [x_of(mark), end], 1.0, mix(INK, PAPER, 0.6))?;
        }
        for (wrist, rgb) in [(R_WRIST, RIGHT), (L_WRIST, LEFT)] {
            for t in frames.clone().skip(1) {
                let from = [x_of(t - 1), y_of(motion.joints[[t - 1, wrist, axis]])];
                let to = [x_of(t), y_of(motion.joints[[t, wrist, axis]])];
                let is_visible = motion.mask[[t, wrist]] && motion.mask[[t - 1, wrist]];
                draw::line(image, from, to, 2.0, if is_visible { rgb } else { mix(rgb, PAPER, 0.6) })?;
            }
        }
    }
    for &mark in marks {
        let label = format!("{:.1} s", motion.fps.secs(mark));
        draw::text(image, &label, [x_of(mark) - 8.0, (top + STRIP_PX) as f32 - 8.0], 9.0, INK)?;
    }
    Ok(())
}
