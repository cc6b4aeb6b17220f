//! One body in a film: joints as a drawn figure, or a performance as its avatar.

use super::film_avatar::{AvatarView, FilmCamera};
use crate::animate::draw::figure::{FigureView, draw_pose};
use crate::animate::performance::Performance;
use crate::animate::rig::rig::bone_metres;
use ndarray::Axis;
use orator_base::types::image::Image;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_ELBOW, L_WRIST, N_JOINTS, R_ELBOW, R_WRIST};
use orator_base::types::time::FrameRate;
use orator_media::opencv::draw;

/// Left, top, right, bottom of an area, px.
pub type FilmArea = [f32; 4];
/// Joints further from the neck than this, metres, are errors of the data and do not shrink the figure.
const FURTHEST_METRES: f32 = 1.2;

/// How a film shows bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmStyle {
    /// Bones as a drawn figure with its sides in two colours.
    Figure,
    /// A clothed avatar, seen by a camera.
    Avatar(FilmCamera),
}

impl Default for FilmStyle {
    fn default() -> Self {
        Self::Avatar(FilmCamera::Front)
    }
}

/// What a film shows of a body.
#[derive(Clone, Copy, Debug)]
pub enum FilmBody<'a> {
    /// Joints as a drawn figure; missing ones are left out. Its head turns as that of the performance.
    Figure(&'a Motion, Option<&'a Performance>),
    /// The avatar of a rig, seen by a camera.
    Avatar(&'a Performance, FilmCamera),
}

impl<'a> FilmBody<'a> {
    /// A performance in a style; its `motion` is for a drawn figure, and without it there is an avatar.
    pub fn new(style: FilmStyle, performance: &'a Performance, motion: Option<&'a Motion>) -> Self {
        match (style, motion) {
            (FilmStyle::Avatar(camera), _) => Self::Avatar(performance, camera),
            (FilmStyle::Figure, Some(motion)) => Self::Figure(motion, Some(performance)),
            (FilmStyle::Figure, None) => Self::Avatar(performance, FilmCamera::default()),
        }
    }

    pub fn fps(self) -> FrameRate {
        match self {
            Self::Figure(motion, _) => motion.fps,
            Self::Avatar(performance, _) => performance.clip.fps,
        }
    }

    pub fn n_frames(self) -> usize {
        match self {
            Self::Figure(motion, _) => motion.n_frames(),
            Self::Avatar(performance, _) => performance.clip.n_frames(),
        }
    }
}

/// Renderer of one body into its area of the picture.
pub enum FilmPanel<'a> {
    Figure { motion: &'a Motion, performance: Option<&'a Performance>, view: FigureView },
    Avatar { view: Box<AvatarView<'a>>, corner: [usize; 2] },
}

impl<'a> FilmPanel<'a> {
    /// Panel in which every frame of the body fits, and of those `beside` it, which are drawn in the same size.
    pub fn new(body: FilmBody<'a>, beside: &[FilmBody], area: FilmArea, yaw_degrees: f32) -> Self {
        match body {
            FilmBody::Figure(motion, performance) => {
                let figures = beside.iter().filter_map(|other| match other {
                    FilmBody::Figure(motion, _) => Some(*motion),
                    FilmBody::Avatar(..) => None,
                });
                let motions: Vec<&Motion> = std::iter::once(motion).chain(figures).collect();
                let view = fitting(&motions, area, yaw_degrees, trunk_of(motions[0]));
                Self::Figure { motion, performance, view: FigureView { trunk: trunk_of(motion), ..view } }
            }
            FilmBody::Avatar(performance, camera) => {
                let [left, top, right, bottom] = area.map(|px| px as usize);
                let avatars = beside.iter().filter_map(|other| match other {
                    FilmBody::Avatar(performance, _) => Some(*performance),
                    FilmBody::Figure(..) => None,
                });
                let shown: Vec<&Performance> = std::iter::once(performance).chain(avatars).collect();
                let view = AvatarView::new(performance, &shown, [right - left, bottom - top], camera);
                Self::Avatar { view: Box::new(view), corner: [left, top] }
            }
        }
    }

    /// Draws a frame; `mouth` is how far the mouth is open, 0..1.
    pub fn draw(&mut self, image: &mut Image, frame_idx: usize, mouth: f64) -> anyhow::Result<()> {
        match self {
            Self::Figure { motion, performance, view } => {
                let looks = performance.and_then(|performance| looks(performance, frame_idx));
                let view = FigureView { looks, ..*view };
                draw_pose(image, motion.joints.index_axis(Axis(0), frame_idx), &view)
            }
            Self::Avatar { view, corner } => {
                draw::paste(image, &view.frame(frame_idx, mouth), *corner);
                Ok(())
            }
        }
    }
}

/// Direction in which a head looks, in the axes of a motion.
fn looks(performance: &Performance, frame_idx: usize) -> Option<[f32; 3]> {
    let world = performance.rig.skeleton.world(performance.clip.local.get(frame_idx)?);
    let [x, y, z] = world[performance.rig.head].turn([0.0, 0.0, 1.0]);
    Some([x, -y, -z].map(|v| v as f32))
}

/// Trunk size that fits the motion's arms.
fn trunk_of(motion: &Motion) -> f32 {
    let metres = bone_metres(motion);
    let arms: f64 = [R_ELBOW, R_WRIST, L_ELBOW, L_WRIST].map(|joint| metres[joint]).iter().sum();
    (arms / 2.0 / 0.55).clamp(0.2, 5.0) as f32
}

/// View from `yaw_degrees` in which trunk, head and every frame's joints of all motions fit into `area`.
fn fitting(motions: &[&Motion], [left, top, right, bottom]: FilmArea, yaw_degrees: f32, trunk: f32) -> FigureView {
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
