//! Motion as a film: the figure from the front and, smaller, from its left, over the sound's wave with a mark that
//! runs along it.

use super::draw::{INK, LEFT, PAPER, RIGHT, View, draw_pose, mix};
use super::figure::bone_metres;
use crate::media::encode::VideoWriter;
use crate::stage::progress::Progress;
use crate::types::image::Image;
use crate::types::pose3d::Motion;
use crate::types::skeleton::{L_ELBOW, L_WRIST, N_JOINTS, R_ELBOW, R_WRIST};
use crate::types::sound::Sound;
use crate::vision::draw;
use std::path::Path;

/// Size of the picture in px.
pub const SIZE: [usize; 2] = [1280, 720];
/// Left, top, right, bottom of what is drawn, px.
type Area = [f32; 4];
const FRONT: Area = [30.0, 24.0, 850.0, 610.0];
const SIDE: Area = [890.0, 90.0, 1250.0, 610.0];
const WAVE: Area = [40.0, 636.0, 1240.0, 684.0];
/// A joint further from the neck than this is an error of the data and does not shrink the figure, metres.
const FURTHEST_METRES: f32 = 1.2;

/// Draws the frames of one motion.
pub struct Film<'a> {
    motion: &'a Motion,
    front: View,
    side: View,
    /// Loudness of each column of the wave, 0..1; empty without sound.
    wave: Vec<f32>,
}

impl<'a> Film<'a> {
    /// One view for the whole film: everything the motion does fits in.
    pub fn new(motion: &'a Motion, sound: Option<&Sound>) -> Self {
        let metres = bone_metres(motion);
        let arms: f64 = [R_ELBOW, R_WRIST, L_ELBOW, L_WRIST].map(|joint| metres[joint]).iter().sum();
        let trunk = (arms / 2.0 / 0.55).clamp(0.2, 5.0) as f32;
        let secs = motion.fps.secs(motion.n_frames());
        Self {
            motion,
            front: fitting(motion, FRONT, 0.0, trunk),
            side: fitting(motion, SIDE, 90.0, trunk),
            wave: sound.map(|sound| loudness(sound, secs)).unwrap_or_default(),
        }
    }

    /// The picture of one frame, `SIZE` px.
    pub fn frame(&self, frame_idx: usize) -> anyhow::Result<Image> {
        let mut image = Image::filled(SIZE[0], SIZE[1], PAPER);
        let joints = self.motion.joints.index_axis(ndarray::Axis(0), frame_idx);
        draw_pose(&mut image, joints, &self.side)?;
        draw_pose(&mut image, joints, &self.front)?;
        self.draw_wave(&mut image, frame_idx)?;
        let words_px = 11.0;
        draw::text(&mut image, "right", [40.0, 50.0], words_px, RIGHT)?;
        draw::text(&mut image, "left", [92.0, 50.0], words_px, LEFT)?;
        draw::text(&mut image, "from the left", [SIDE[0] + 20.0, 50.0], words_px, INK)?;
        let clock = format!("{} / {}", clock(self.motion.fps.secs(frame_idx)), clock(self.secs()));
        draw::text(&mut image, &clock, [WAVE[0], 706.0], words_px, INK)?;
        Ok(image)
    }

    fn secs(&self) -> f64 {
        self.motion.fps.secs(self.motion.n_frames())
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

/// Writes the film as an mp4 with the sound. It writes in place: call it inside `stage::workdir::replace`.
pub fn write(path: &Path, motion: &Motion, sound: Option<&Sound>, progress: &dyn Progress) -> anyhow::Result<()> {
    let film = Film::new(motion, sound);
    let task = progress.begin("drawing", motion.n_frames() as u64);
    let mut writer = VideoWriter::create(path, SIZE[0], SIZE[1], motion.fps, sound)?;
    for frame_idx in 0..motion.n_frames() {
        writer.push(&film.frame(frame_idx)?)?;
        task.advance(1);
    }
    writer.finish()
}

/// Width of a column of the wave.
const COLUMN_PX: f32 = 4.0;

/// Root mean square of the sound in each column of the wave, the loudest 1; silence after its end.
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

/// The view from `yaw_degrees` in which trunk, head and every frame's joints fit into `area`.
fn fitting(motion: &Motion, [left, top, right, bottom]: Area, yaw_degrees: f32, trunk: f32) -> View {
    let plain = View { yaw_degrees, trunk, ..View::front([0.0, 0.0], 1.0) };
    // Head, trunk and, at least, the arms hanging beside it.
    let (mut x, mut y) = ([-0.30 * trunk, 0.30 * trunk], [-0.33 * trunk, 0.60 * trunk]);
    for frame in motion.joints.outer_iter() {
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
    let middle = |area: [f32; 2], figure: [f32; 2]| (area[0] + area[1] - px_per_metre * (figure[0] + figure[1])) / 2.0;
    View { neck_px: [middle([left, right], x), middle([top, bottom], y)], px_per_metre, ..plain }
}

/// `1:05.3`
fn clock(secs: f64) -> String {
    let tenths = (secs * 10.0).round() as u64;
    format!("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10)
}
