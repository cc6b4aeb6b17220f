//! Contact sheet of a lifted clip: at regular moments the frame with its keypoints, the 3D pose from the front and from
//! the left, optionally the animated rig, and on each page a chart of the wrists. The video is streamed; only one page
//! is in memory.

use super::cells::{CELL_PX, CellView, SheetCrop, pose_cell};
use anyhow::{Context, Result, ensure};
use ndarray::{Array3, Axis};
use orator_avatar::animate::draw::figure::{INK, LEFT, PAPER, RIGHT, mix};
use orator_base::stage::ledger::RejectedInterval;
use orator_base::stage::progress::Progress;
use orator_base::stage::rejection::Rejection;
use orator_base::types::image::{Image, PictureOptions};
use orator_base::types::pose2d::{Keypoints, coco};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, L_WRIST, N_HAND_JOINTS, R_HAND, R_WRIST};
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::opencv::draw;
use orator_pipeline::lift::quality::jitter_around;
use std::ops::Range;
use std::path::Path;

/// Rows of moments on a page.
const ROWS: usize = 5;
const TEXT_PX: usize = 22;
const GAP_PX: usize = 16;
/// Height of a moment: a line of text, its cells, a gap.
const MOMENT_HEIGHT_PX: usize = TEXT_PX + CELL_PX + 6;
const TITLE_PX: usize = 36;
/// Position of the reason in a cell without joints, px from the top.
const NO_JOINTS_PX: f32 = 200.0;

pub struct SheetClip<'a> {
    pub title: &'a str,
    pub video: &'a Path,
    pub pictures: PictureOptions,
    pub keypoints: &'a Keypoints,
    pub motion: &'a Motion,
    /// Rejected intervals of the video, whose reasons are drawn in the empty cells.
    pub rejected: &'a [RejectedInterval],
    /// Motion of the animated rig in the same frames as `motion`; `None`: it is not shown.
    pub figure: Option<&'a Motion>,
}

impl SheetClip<'_> {
    /// Draws a moment every `every_secs` and passes each page to `page_done` (page index, number of pages, picture).
    ///
    /// # Errors
    /// No frames; keypoints, motion and video of different lengths or rates; `every_secs` shorter than a frame.
    pub fn pages(
        &self,
        every_secs: f64,
        progress: &dyn Progress,
        mut page_done: impl FnMut(usize, usize, &Image) -> Result<()>,
    ) -> Result<()> {
        let moments = self.moments(every_secs)?;
        let mut reader = FrameReader::open_with(self.video, self.motion.fps, 0)?.with_options(self.pictures);
        self.check_length(&reader)?;
        let crop = SheetCrop::around(self.keypoints, reader.image_size());
        let task = progress.begin("drawing", moments.len() as u64);
        let pages: Vec<&[usize]> = moments.chunks(self.n_columns() * ROWS).collect();
        for (number, moments) in pages.iter().enumerate() {
            let end = pages.get(number + 1).and_then(|next| next.first()).copied().unwrap_or(self.motion.n_frames());
            let n_rows = moments.len().div_ceil(self.n_columns());
            let strip_top = TITLE_PX + n_rows * MOMENT_HEIGHT_PX;
            let mut page =
                Image::filled(self.n_columns() * self.moment_width_px() - GAP_PX, strip_top + STRIP_PX, PAPER);
            self.draw_title(&mut page, number, pages.len())?;
            for (n, &moment) in moments.iter().enumerate() {
                let (column, row) = (n % self.n_columns(), n / self.n_columns());
                let corner = [column * self.moment_width_px(), TITLE_PX + row * MOMENT_HEIGHT_PX];
                self.draw_moment(&mut page, corner, moment, &mut reader, &crop)?;
                task.advance(1);
            }
            let frames = moments.first().copied().unwrap_or(0)..end;
            draw_strip(&mut page, strip_top, self.motion, frames, moments)?;
            page_done(number, pages.len(), &page)?;
        }
        Ok(())
    }

    /// Number of moments side by side.
    fn n_columns(&self) -> usize {
        if self.figure.is_some() { 1 } else { 2 }
    }

    fn moment_width_px(&self) -> usize {
        let n_cells = if self.figure.is_some() { 5 } else { 3 };
        n_cells * CELL_PX + GAP_PX
    }

    fn moments(&self, every_secs: f64) -> Result<Vec<usize>> {
        let (n_frames, fps) = (self.motion.n_frames(), self.motion.fps);
        ensure!(n_frames > 0, "the motion has no frames: expected at least 1");
        let n_keypoints = self.keypoints.n_frames();
        ensure!(
            n_frames == n_keypoints,
            "the motion has {n_frames} frames, the keypoints have {n_keypoints}: expected the same clip; if the \
             keypoints have changed since, lift them again"
        );
        let other = self.keypoints.fps;
        ensure!(fps == other, "the motion is at {fps}, the keypoints at {other}: lift the keypoints again");
        let step = every_secs * fps.per_sec();
        ensure!(
            step.is_finite() && step >= 1.0,
            "invalid interval of {every_secs} s between poses: at {fps}, expected at least {:.3} s",
            fps.secs(1)
        );
        let moments = (0..).map(|n| (f64::from(n) * step).round() as usize).take_while(|&frame| frame < n_frames);
        Ok(moments.collect())
    }

    /// Checks that video and motion differ in length by at most 1 s; skipped if the video's headers do not state it.
    fn check_length(&self, reader: &FrameReader) -> Result<()> {
        let (n_frames, fps) = (self.motion.n_frames(), self.motion.fps);
        let Some(expected) = reader.expected_frames() else { return Ok(()) };
        let difference_secs = fps.secs(n_frames.abs_diff(expected));
        ensure!(
            difference_secs <= 1.0,
            "the motion has {n_frames} frames at {fps} ({:.2} s), the video {} lasts {:.2} s: expected the same clip, \
             or the `fps` of the keypoints is wrong",
            fps.secs(n_frames),
            self.video.display(),
            fps.secs(expected)
        );
        Ok(())
    }

    fn draw_title(&self, page: &mut Image, number: usize, n_pages: usize) -> Result<()> {
        let title =
            if n_pages > 1 { format!("{}   {}/{n_pages}", self.title, number + 1) } else { self.title.to_owned() };
        draw::text(page, &title, [8.0, 25.0], 12.0, INK)?;
        let right = page.width as f32;
        draw::text(page, "speaker's right", [right - 330.0, 25.0], 11.0, RIGHT)?;
        draw::text(page, "speaker's left", [right - 160.0, 25.0], 11.0, LEFT)
    }

    fn draw_moment(
        &self,
        page: &mut Image,
        [left, top]: [usize; 2],
        frame_idx: usize,
        reader: &mut FrameReader,
        crop: &SheetCrop,
    ) -> Result<()> {
        loop {
            let time = reader.advance()?.with_context(|| {
                let secs = self.motion.fps.secs(frame_idx);
                format!(
                    "{} ends before {secs:.2} s, but the motion does not: expected the same clip",
                    self.video.display()
                )
            })?;
            if time.frame_idx == frame_idx {
                break;
            }
        }
        let joints = self.motion.joints.index_axis(Axis(0), frame_idx);
        let mut cells = vec![
            crop.cell(reader, self.keypoints, frame_idx)?,
            pose_cell(joints, CellView::Front)?,
            pose_cell(joints, CellView::Left)?,
        ];
        if joints.iter().all(|value| !value.is_finite()) {
            let reason = self.reason(frame_idx);
            for cell in &mut cells[1..] {
                draw::text(cell, &reason, [20.0, NO_JOINTS_PX], 10.0, INK)?;
            }
        }
        if let Some(figure) = self.figure.filter(|figure| frame_idx < figure.n_frames()) {
            let joints = figure.joints.index_axis(Axis(0), frame_idx);
            for from in [CellView::Front, CellView::Left] {
                let mut cell = pose_cell(joints, from)?;
                draw::text(&mut cell, "animated", [6.0, 30.0], 9.0, INK)?;
                cells.push(cell);
            }
        }
        for (column, cell) in cells.iter().enumerate() {
            draw::paste(page, cell, [left + column * CELL_PX, top + TEXT_PX]);
        }
        draw::text(page, &self.caption(frame_idx), [left as f32 + 6.0, (top + TEXT_PX - 6) as f32], 10.0, INK)
    }

    fn reason(&self, frame_idx: usize) -> String {
        // The middle of the frame, since intervals may end at its beginning.
        let secs = (frame_idx as f64 + 0.5) / self.motion.fps.per_sec();
        let span = self.rejected.iter().find(|span| (span.start_secs..span.end_secs).contains(&secs));
        let label = span.map_or("no joints in this frame", |span| Rejection::label(&span.reason));
        format!("not lifted: {label}")
    }

    /// Text above a moment, as in `3.0 s   wrist jitter L 2.1 R 0.9 mm   rejected: left hand`. A part is rejected if
    /// its keypoints were detected but its joints are masked. No jitter is printed for a wrist without joints.
    fn caption(&self, frame_idx: usize) -> String {
        let mask = self.motion.mask.row(frame_idx);
        let is_half_visible = |root: usize| (1..N_HAND_JOINTS).filter(|j| mask[root + j]).count() * 2 >= N_HAND_JOINTS;
        let Keypoints { body, left_hand, right_hand, .. } = self.keypoints;
        let found = |points: &Array3<f32>, point: usize| points[[frame_idx, point, 2]] > 0.0;
        let parts = [
            ("right wrist", mask[R_WRIST], found(body, coco::R_WRIST)),
            ("left wrist", mask[L_WRIST], found(body, coco::L_WRIST)),
            ("right hand", is_half_visible(R_HAND), found(right_hand, 0)),
            ("left hand", is_half_visible(L_HAND), found(left_hand, 0)),
        ];
        let without = |is_found: bool| {
            let names = parts.iter().filter(|part| !part.1 && part.2 == is_found).map(|part| part.0);
            names.collect::<Vec<_>>().join(", ")
        };
        let mut texts = vec![format!("{:.1} s", self.motion.fps.secs(frame_idx))];
        let jitters =
            [("L", L_WRIST), ("R", R_WRIST)].map(|(side, at)| (side, jitter_around(self.motion, at, frame_idx)));
        let jitters = jitters.into_iter().filter(|(_, mm)| mm.is_finite()).map(|(side, mm)| format!(" {side} {mm:.1}"));
        let jitters: String = jitters.collect();
        if !jitters.is_empty() {
            texts.push(format!("wrist jitter{jitters} mm"));
        }
        for (reason, parts) in [("rejected", without(true)), ("not detected", without(false))] {
            if !parts.is_empty() {
                texts.push(format!("{reason}: {parts}"));
            }
        }
        texts.join("   ")
    }
}

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
