//! Avatar of a performance over a plain backdrop, framed so that head, hips and every gesture fit.

use super::film_source::SourceCamera;
use crate::animate::avatar::{Appearance, Avatar};
use crate::animate::performance::Performance;
use crate::render::{Background, Light, Mesh, PinholeCamera, Renderer};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale};
use orator_base::types::image::Image;
use orator_base::types::skeleton::N_JOINTS;

/// Viewpoint of a film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FilmCamera {
    #[default]
    Front,
    /// From the speaker's left and slightly above.
    ThreeQuarter,
}

impl FilmCamera {
    /// Azimuth towards the speaker's left and elevation of the view, degrees.
    fn degrees(self) -> [f64; 2] {
        match self {
            Self::Front => [0.0, 3.0],
            Self::ThreeQuarter => [38.0, 9.0],
        }
    }

    /// Rotation about the vertical axis.
    fn turn(self) -> Rotation {
        Rotation::about([0.0, 1.0, 0.0], self.degrees()[0].to_radians())
    }

    /// Camera of `size` px in which all of these performances fit.
    fn framing(self, shown: &[&Performance], size: [usize; 2]) -> PinholeCamera {
        let upwards = Rotation::about([1.0, 0.0, 0.0], -self.degrees()[1].to_radians());
        let towards_camera = self.turn().turn(upwards.turn([0.0, 0.0, 1.0]));
        let points: Vec<Vec3> = shown.iter().flat_map(|performance| extremes(performance)).collect();
        fit_camera(&points, towards_camera, size)
    }
}

/// Focal length relative to the image height; long enough not to distort hands that reach forward.
const FOCAL_RATIO: f64 = 2.2;
/// Margin around the content, as a fraction of the image.
const MARGIN: f64 = 0.06;
/// Radius of the body around a joint, cm.
const BODY_RADIUS_CM: f64 = 4.0;
/// Direction of the key light for a front view.
const TO_KEY: Vec3 = [-0.5, 0.8, 0.7];
/// Colours of the backdrop.
const TOP_COLOUR: [u8; 3] = [206, 211, 216];
const BOTTOM_COLOUR: [u8; 3] = [146, 152, 158];
/// Maximum number of frames that determine the framing.
const MAX_FRAMED: usize = 600;

/// Avatar and camera that films of several performances on one rig share.
#[derive(Clone, Debug)]
pub struct AvatarStage {
    avatar: Avatar,
    pub camera: PinholeCamera,
    from: FilmCamera,
}

impl AvatarStage {
    /// Avatar of the performances' rig, with a camera of `size` px in which all of them fit; `None` without a
    /// performance.
    pub fn new(shown: &[&Performance], appearance: &Appearance, size: [usize; 2], from: FilmCamera) -> Option<Self> {
        let avatar = Avatar::new(&shown.first()?.rig, appearance);
        Some(Self { avatar, camera: from.framing(shown, size), from })
    }
}

/// Renderer of one performance.
pub struct AvatarView<'a> {
    performance: &'a Performance,
    avatar: Avatar,
    camera: PinholeCamera,
    light: Light,
    backdrop: Background,
    renderer: Renderer,
    meshes: Vec<Mesh>,
}

impl<'a> AvatarView<'a> {
    /// View of `size` px in which all the `shown` performances fit.
    pub fn new(performance: &'a Performance, shown: &[&Performance], size: [usize; 2], from: FilmCamera) -> Self {
        let avatar = Avatar::new(&performance.rig, &Appearance::plain());
        Self::on(&AvatarStage { avatar, camera: from.framing(shown, size), from }, performance)
    }

    /// View of a performance whose rig is that of the stage.
    pub fn on(stage: &AvatarStage, performance: &'a Performance) -> Self {
        let AvatarStage { avatar, camera, from } = stage.clone();
        let size = camera.size;
        Self {
            performance,
            avatar,
            camera,
            light: Light::studio(from.turn().turn(TO_KEY)),
            backdrop: Background::gradient(size, TOP_COLOUR, BOTTOM_COLOUR),
            renderer: Renderer::new(size),
            meshes: Vec::new(),
        }
    }

    /// Number of triangles of the avatar.
    pub fn n_triangles(&self) -> usize {
        self.avatar.parts.iter().map(|part| part.triangles.len()).sum()
    }

    /// Image of one frame with the mouth opened by `mouth`, 0..1.
    pub fn frame(&mut self, frame_idx: usize, mouth: f64) -> Image {
        let Performance { rig, clip, .. } = self.performance;
        self.avatar.pose_into(rig, clip.root_at(frame_idx), &clip.local[frame_idx], mouth, &mut self.meshes);
        let meshes: Vec<&Mesh> = self.meshes.iter().collect();
        self.renderer.draw(&self.camera, &meshes, &self.light, &self.backdrop)
    }

    /// Image of one frame over a video frame of the view's size, from the camera of the video.
    pub fn frame_over(&mut self, video_frame: Image, frame_idx: usize, mouth: f64, source: &SourceCamera) -> Image {
        let Performance { rig, clip, .. } = self.performance;
        let neck = clip.positions(frame_idx)[rig.neck];
        self.camera = source.at(clip.fps.secs(frame_idx), neck, self.camera.size);
        self.backdrop = Background::picture(video_frame);
        self.frame(frame_idx, mouth)
    }
}

/// Points that must be visible: arms, hands, the top of the head and the hips in all frames.
fn extremes(performance: &Performance) -> Vec<Vec3> {
    let Performance { rig, clip, .. } = performance;
    let n_frames = clip.n_frames();
    let step = n_frames.div_ceil(MAX_FRAMED).max(1);
    let mut points = Vec::new();
    for frame_idx in (0..n_frames).step_by(step) {
        let places = clip.positions(frame_idx);
        let body = (places[rig.head][1] - places[0][1]).abs();
        points.extend((0..N_JOINTS).map(|joint| places[rig.positions[joint]]));
        // The crown is about as far above the head joint as a third of the distance from there to the hips.
        points.extend([-0.18, 0.18].map(|aside| add(places[rig.head], [aside * body, 0.36 * body, 0.0])));
        points.push(add(places[0], [0.0, -0.12 * body, 0.0]));
    }
    points
}

/// The nearest camera in direction `towards_camera` from which all points are visible.
fn fit_camera(points: &[Vec3], towards_camera: Vec3, size: [usize; 2]) -> PinholeCamera {
    let focal_px = FOCAL_RATIO * size[1] as f64;
    let at = |target: Vec3, away: f64| {
        PinholeCamera::looking_at(size, focal_px, add(target, scale(towards_camera, away)), target, 0.0)
    };
    // Axes of the view; the camera aims at the centre of the points.
    let plain = at([0.0; 3], 1.0);
    let points: Vec<Vec3> = points.iter().map(|point| plain.axes.turn(*point)).collect();
    let ends = [0, 1, 2].map(|k| {
        let values = || points.iter().map(|point| point[k]);
        [
            values().fold(f64::INFINITY, f64::min) - BODY_RADIUS_CM,
            values().fold(f64::NEG_INFINITY, f64::max) + BODY_RADIUS_CM,
        ]
    });
    if ends.iter().flatten().any(|v| !v.is_finite()) {
        return at([0.0, 120.0, 0.0], 300.0);
    }
    let middle = ends.map(|[low, high]| (low + high) / 2.0);
    let per_depth = [0, 1].map(|k| focal_px / ((0.5 - MARGIN) * size[k] as f64));
    let away = points.iter().map(|point| {
        let across = |k: usize| per_depth[k] * ((point[k] - middle[k]).abs() + BODY_RADIUS_CM);
        across(0).max(across(1)) - (point[2] - middle[2])
    });
    at(plain.axes.inverse().turn(middle), away.fold(0.0, f64::max))
}
