//! Motion as a film: the figure from the front; beside it the figure from its left, the source video, or another
//! motion; below, the sound's waveform with a running mark.

use crate::animate::draw::figure::{FigureView, INK, LEFT, PAPER, RIGHT, draw_pose, mix};
use crate::animate::rig::rig::bone_metres;
use crate::external::ffmpeg::encode::VideoWriter;
use crate::external::ffmpeg::frames::FrameReader;
use crate::external::opencv::draw;
use crate::stage::progress::Progress;
use crate::types::image::Image;
use crate::types::pose3d::Motion;
use crate::types::skeleton::{L_ELBOW, L_WRIST, N_JOINTS, R_ELBOW, R_WRIST};
use crate::types::sound::Sound;
use anyhow::{Context as _, ensure};
use std::path::Path;

/// Size of the picture in px.
pub const SIZE: [usize; 2] = [1280, 720];
/// Left, top, right, bottom of an area, px.
type Area = [f32; 4];
const FRONT: Area = [30.0, 24.0, 850.0, 610.0];
const SIDE: Area = [890.0, 90.0, 1250.0, 610.0];
const HALVES: [Area; 2] = [[30.0, 66.0, 630.0, 610.0], [650.0, 66.0, 1250.0, 610.0]];
const WAVE: Area = [40.0, 636.0, 1240.0, 684.0];
/// Joints further from the neck than this, metres, are errors of the data and do not shrink the figure.
const FURTHEST_METRES: f32 = 1.2;
const WORDS_PX: f32 = 11.0;

/// Content of the picture's second half.
#[derive(Clone, Copy, Debug, Default)]
pub enum SecondPanel<'a> {
    /// The figure from its left.
    #[default]
    Itself,
    /// Frames of a video from this second of it on.
    Video { path: &'a Path, from_secs: f64 },
    /// Another motion, drawn in the same size; the labels of the two, the other last.
    Motion { motion: &'a Motion, labels: [&'a str; 2] },
}

/// Renderer of one motion's frames.
pub struct Film<'a> {
    motion: &'a Motion,
    panels: Vec<FilmPanel<'a>>,
    /// Loudness of each column of the waveform, 0..1; empty without sound.
    wave: Vec<f32>,
}

/// One figure in the picture.
struct FilmPanel<'a> {
    motion: &'a Motion,
    view: FigureView,
    label: &'a str,
    /// Left edge of the label, px.
    label_px: f32,
}

impl<'a> Film<'a> {
    /// Film with one view in which every frame of the motion fits.
    pub fn new(motion: &'a Motion, sound: Option<&Sound>, beside: SecondPanel<'a>) -> Self {
        let trunk = trunk_of(motion);
        let panel = |motion, view, label, label_px| FilmPanel { motion, view, label, label_px };
        let own = |area, yaw, label, label_px| panel(motion, fitting(&[motion], area, yaw, trunk), label, label_px);
        let panels = match beside {
            SecondPanel::Itself => {
                vec![own(SIDE, 90.0, "from the left", SIDE[0] + 20.0), own(FRONT, 0.0, "", FRONT[0])]
            }
            SecondPanel::Video { .. } => vec![own(HALVES[1], 0.0, "", HALVES[1][0])],
            SecondPanel::Motion { motion: other, labels } => {
                let half = |((shown, label), area): ((&'a Motion, _), Area)| {
                    let view = fitting(&[motion, other], area, 0.0, trunk);
                    panel(shown, FigureView { trunk: trunk_of(shown), ..view }, label, (area[0] + area[2]) / 2.0 - 40.0)
                };
                [motion, other].into_iter().zip(labels).zip(HALVES).map(half).collect()
            }
        };
        let secs = motion.fps.secs(motion.n_frames());
        Self { motion, panels, wave: sound.map(|sound| loudness(sound, secs)).unwrap_or_default() }
    }

    /// Picture of one frame, `SIZE` px; an empty area in place of a video.
    pub fn frame(&self, frame_idx: usize) -> anyhow::Result<Image> {
        let mut image = Image::filled(SIZE[0], SIZE[1], PAPER);
        let secs = self.motion.fps.secs(frame_idx);
        for FilmPanel { motion, view, label, label_px } in &self.panels {
            // The other motion's frame nearest in time, none after its end.
            let shown =
                if motion.fps == self.motion.fps { frame_idx } else { (secs * motion.fps.per_sec()).round() as usize };
            if shown < motion.n_frames() {
                draw_pose(&mut image, motion.joints.index_axis(ndarray::Axis(0), shown), view)?;
            }
            draw::text(&mut image, label, [*label_px, 50.0], WORDS_PX, INK)?;
        }
        self.draw_wave(&mut image, frame_idx)?;
        let legend_px =
            self.panels.last().map_or(40.0, |last| if last.label.is_empty() { last.label_px + 10.0 } else { 40.0 });
        draw::text(&mut image, "right", [legend_px, 50.0], WORDS_PX, RIGHT)?;
        draw::text(&mut image, "left", [legend_px + 52.0, 50.0], WORDS_PX, LEFT)?;
        let clock = format!("{} / {}", clock(secs), clock(self.motion.fps.secs(self.motion.n_frames())));
        draw::text(&mut image, &clock, [WAVE[0], 706.0], WORDS_PX, INK)?;
        Ok(image)
    }

    fn draw_wave(&self, image: &mut Image, frame_idx: usize) -> anyhow::Result<()> {
        let [left, top, right, bottom] = WAVE;
        let middle = (top + bottom) / 2.0;
        let faint = mix(INK, PAPER, 0.65);
        let now = left + (right - left) * (frame_idx as f32 + 0.5) / self.motion.n_frames().max(1) as f32;
        draw::line(image, [left, middle], [right, middle], 1.0, faint)?;
        for (column, height) in self.wave.iter().enumerate() {
            let x = left + COLUMN_PX * (column as f32 + 0.5);
            let half = (height * (bottom - top) / 2.0).max(0.5);
            let rgb = if x < now { INK } else { faint };
            draw::line(image, [x, middle - half], [x, middle + half], 2.0, rgb)?;
        }
        draw::line(image, [now, top - 4.0], [now, bottom + 4.0], 2.0, mix(INK, [0; 3], 0.4))
    }
}

/// Writes the film as an mp4 with the sound, in place; callers wrap it in `stage::workdir::replace`.
pub fn write(
    path: &Path,
    motion: &Motion,
    sound: Option<&Sound>,
    beside: SecondPanel,
    progress: &dyn Progress,
) -> anyhow::Result<()> {
    let film = Film::new(motion, sound, beside);
    let mut footage = match beside {
        SecondPanel::Video { path, from_secs } => Some(FilmFootage::open(path, motion, from_secs)?),
        _ => None,
    };
    let task = progress.begin("drawing", motion.n_frames() as u64);
    let mut writer = VideoWriter::create(path, SIZE[0], SIZE[1], motion.fps, sound)?;
    for frame_idx in 0..motion.n_frames() {
        let mut image = film.frame(frame_idx)?;
        if let Some(footage) = &mut footage {
            footage.show(&mut image)?;
        }
        writer.push(&image)?;
        task.advance(1);
    }
    writer.finish()
}

/// Frames of a video in step with a motion.
struct FilmFootage {
    frames: FrameReader,
    /// Width and height of its pictures in the film, px.
    size: [usize; 2],
    ended: bool,
}

impl FilmFootage {
    fn open(path: &Path, motion: &Motion, from_secs: f64) -> anyhow::Result<Self> {
        ensure!(from_secs.is_finite() && from_secs >= 0.0, "a video cannot be shown from second {from_secs} on");
        let mut frames = FrameReader::open(path, motion.fps)?;
        for _ in 0..(from_secs * motion.fps.per_sec()).round() as u64 {
            frames.advance()?.with_context(|| {
                let secs = frames.duration_secs();
                format!("{} lasts {secs:.1} s: it cannot be shown from second {from_secs} on", path.display())
            })?;
        }
        let [left, top, right, bottom] = HALVES[0];
        let [width, height] = frames.image_size().map(|px| px as f32);
        let scale = ((right - left) / width).min((bottom - top) / height);
        let size = [width, height].map(|px| ((px * scale) as usize).max(2));
        Ok(Self { frames, size, ended: false })
    }

    /// Draws the next frame into its area; nothing after the last one.
    fn show(&mut self, image: &mut Image) -> anyhow::Result<()> {
        self.ended = self.ended || self.frames.advance()?.is_none();
        if self.ended {
            return Ok(());
        }
        let picture = self.frames.picture(Some(self.size))?;
        let [left, top, right, bottom] = HALVES[0].map(|px| px as usize);
        let (x0, y0) = (left + (right - left - picture.width) / 2, top + (bottom - top - picture.height) / 2);
        draw::paste(image, &picture, [x0, y0]);
        Ok(())
    }
}

/// Trunk size that fits the motion's arms.
fn trunk_of(motion: &Motion) -> f32 {
    let metres = bone_metres(motion);
    let arms: f64 = [R_ELBOW, R_WRIST, L_ELBOW, L_WRIST].map(|joint| metres[joint]).iter().sum();
    (arms / 2.0 / 0.55).clamp(0.2, 5.0) as f32
}

/// Width of a column of the wave.
const COLUMN_PX: f32 = 4.0;

/// Root mean square of the sound in each column of the waveform, the loudest 1; 0 after its end.
fn loudness(sound: &Sound, secs: f64) -> Vec<f32> {
    let n_columns = ((WAVE[2] - WAVE[0]) / COLUMN_PX) as usize;
    let samples = secs * f64::from(sound.rate) / n_columns as f64;
    let mut columns: Vec<f32> = (0..n_columns)
        .map(|column| {
            let at = |column: usize| ((column as f64 * samples) as usize).min(sound.samples.len());
            let part = &sound.samples[at(column)..at(column + 1)];
            (part.iter().map(|v| v * v).sum::<f32>() / part.len().max(1) as f32).sqrt()
        })
        .collect();
    let loudest = columns.iter().copied().fold(1e-4, f32::max);
    columns.iter_mut().for_each(|column| *column /= loudest);
    columns
}

/// View from `yaw_degrees` in which trunk, head and every frame's joints of all motions fit into `area`.
fn fitting(motions: &[&Motion], [left, top, right, bottom]: Area, yaw_degrees: f32, trunk: f32) -> FigureView {
    let plain = FigureView { yaw_degrees, trunk, ..FigureView::front([0.0, 0.0], 1.0) };
    // Head, trunk and, at least, the arms hanging beside it.
    let (mut x, mut y) = ([-0.30 * trunk, 0.30 * trunk], [-0.33 * trunk, 0.60 * trunk]);
    for frame in motions.iter().flat_map(|motion| motion.joints.outer_iter()) {
        for joint in 0..N_JOINTS {
            let place: [f32; 3] = std::array::from_fn(|k| frame[[joint, k]]);
            let (at, _) = plain.project(place);
            if place.iter().all(|v| v.abs() < FURTHEST_METRES) && at.iter().all(|v| v.is_finite()) {
                x = [x[0].min(at[0] - 0.03), x[1].max(at[0] + 0.03)];
                y = [y[0].min(at[1] - 0.03), y[1].max(at[1] + 0.03)];
            }
        }
    }
    let px_per_metre = ((right - left) / (x[1] - x[0])).min((bottom - top) / (y[1] - y[0]));
    let middle = |area: [f32; 2], span: [f32; 2]| (area[0] + area[1] - px_per_metre * (span[0] + span[1])) / 2.0;
    FigureView { neck_px: [middle([left, right], x), middle([top, bottom], y)], px_per_metre, ..plain }
}

/// Time as minutes and seconds: `1:05.3`.
fn clock(secs: f64) -> String {
    let tenths = (secs * 10.0).round() as u64;
    format!("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10)
}
