//! Avatars of performances over a plain backdrop: one, framed so that head, hips and every gesture fit, or two side by
//! side without their heads.

use super::film_source::SourceCamera;
use crate::animate::avatar::{Appearance, Avatar, Material};
use crate::animate::performance::Performance;
use crate::render::{Background, Light, Mesh, PinholeCamera, Renderer};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale};
use orator_base::types::image::Image;
use orator_base::types::skeleton::N_JOINTS;
use rayon::prelude::*;

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
const BODY_RADIUS_CM: f64 = 4.0;
/// Direction of the key light for a front view.
const TO_KEY: Vec3 = [-0.5, 0.8, 0.7];
/// Colours of the backdrop.
const TOP_COLOUR: [u8; 3] = [206, 211, 216];
const BOTTOM_COLOUR: [u8; 3] = [146, 152, 158];
/// Maximum number of frames that determine the framing.
const MAX_FRAMED: usize = 600;

/// Distance from the line on which two avatars stand to their camera, cm (Rebol et al. 2021, section 4.1).
const PAIR_DEPTH_CM: f64 = 300.0;
/// Width of the picture of two avatars on that line, cm.
const PAIR_WIDTH_CM: f64 = 250.0;
/// Minimum distance of a head above the top edge of that picture, cm.
const ABOVE_TOP_CM: f64 = 1.0;
/// Offsets of the avatars of a picture, cm, left to right; two avatars are 1.5 m apart.
const ALONE: [Vec3; 1] = [[0.0; 3]];
const PAIR: [Vec3; 2] = [[-75.0, 0.0, 0.0], [75.0, 0.0, 0.0]];
const HEAD_MATERIALS: [Material; 4] = [Material::Face, Material::Eyes, Material::Hair, Material::Frames];

/// Avatar and camera that films of several performances on one rig share.
#[derive(Clone, Debug)]
pub struct AvatarStage {
    avatar: Avatar,
    pub camera: PinholeCamera,
    from: FilmCamera,
    /// Offset of each avatar of the picture, cm.
    offsets: &'static [Vec3],
}

impl AvatarStage {
    /// Avatar of the performances' rig, with a camera of `size` px in which they all fit; `None` without a performance.
    pub fn new(shown: &[&Performance], appearance: &Appearance, size: [usize; 2], from: FilmCamera) -> Option<Self> {
        let avatar = Avatar::new(&shown.first()?.rig, appearance);
        Some(Self { avatar, camera: from.framing(shown, size), from, offsets: &ALONE })
    }

    /// Two avatars of the performances' rig in one picture of `size` px, the scene of Rebol et al. (2021), section 4.1:
    /// 1.5 m apart, both facing +z, 3 m in front of a level camera, without their heads.
    ///
    /// The paper does not state the angle of view. Here the picture is 2.5 m wide at the avatars, so that half a metre
    /// remains for each outer arm. The top edge is 1 cm below the lowest position of the chin and the upper neck in all
    /// frames of `shown`. The bottom edge follows from the aspect: at 1000 x 360 px the picture is 0.9 m high and ends
    /// below the hips. `None` without a performance.
    pub fn side_by_side(shown: &[&Performance], appearance: &Appearance, size: [usize; 2]) -> Option<Self> {
        let rig = &shown.first()?.rig;
        let avatar = Avatar::new(rig, appearance);
        let focal_px = PAIR_DEPTH_CM * size[0] as f64 / PAIR_WIDTH_CM;
        let height = height_below_heads(&avatar, shown, size[1] as f64 / 2.0 / focal_px);
        let height = if height.is_finite() { height } else { rig.root[1] };
        let position = [0.0, height, PAIR_DEPTH_CM];
        let camera = PinholeCamera::looking_at(size, focal_px, position, [0.0, height, 0.0], 0.0);
        Some(Self { avatar, camera, from: FilmCamera::Front, offsets: &PAIR })
    }
}

/// Maximum height of a level camera at `PAIR_DEPTH_CM` from which no head is visible, cm; `slope` is the tangent of half
/// its vertical angle of view. Infinite without a frame.
fn height_below_heads(avatar: &Avatar, shown: &[&Performance], slope: f64) -> f64 {
    let parts = avatar.parts.iter().filter(|part| HEAD_MATERIALS.contains(&part.material));
    let head = Avatar { parts: parts.cloned().collect() };
    let height = |performance: &&Performance| {
        let Performance { rig, clip, .. } = *performance;
        let (mut meshes, mut height) = (Vec::new(), f64::INFINITY);
        for frame_idx in 0..clip.n_frames() {
            head.pose_into(rig, clip.root_at(frame_idx), &clip.local[frame_idx], 0.0, &mut meshes);
            for point in meshes.iter().flat_map(|mesh| head_points(mesh, rig.head)) {
                let [_, y, z] = point.map(f64::from);
                height = height.min(y - ABOVE_TOP_CM - slope * (PAIR_DEPTH_CM - z));
            }
        }
        height
    };
    shown.par_iter().map(height).reduce(|| f64::INFINITY, f64::min)
}

/// Corners of the triangles that the joint `head` moves, entirely or in part; the neck belongs to the same mesh.
fn head_points(mesh: &Mesh, head: usize) -> impl Iterator<Item = [f32; 3]> {
    let is_head = move |vertex: &u32| usize::from(mesh.labels[*vertex as usize]) == head;
    let triangles = mesh.triangles.iter().filter(move |triangle| triangle.iter().any(is_head));
    triangles.flat_map(move |triangle| triangle.map(|vertex| mesh.points[vertex as usize]))
}

/// One avatar of a picture, with the meshes of its last pose.
struct PlacedAvatar<'a> {
    performance: &'a Performance,
    offset: Vec3,
    meshes: Vec<Mesh>,
}

pub struct AvatarView<'a> {
    placed: Vec<PlacedAvatar<'a>>,
    avatar: Avatar,
    camera: PinholeCamera,
    light: Light,
    backdrop: Background,
    renderer: Renderer,
}

impl<'a> AvatarView<'a> {
    /// View of `size` px in which all the `shown` performances fit.
    pub fn new(performance: &'a Performance, shown: &[&Performance], size: [usize; 2], from: FilmCamera) -> Self {
        let avatar = Avatar::new(&performance.rig, &Appearance::plain());
        Self::on(&AvatarStage { avatar, camera: from.framing(shown, size), from, offsets: &ALONE }, [performance])
    }

    /// View of performances whose rig is that of the stage, left to right; those beyond its avatars are ignored.
    pub fn on(stage: &AvatarStage, performances: impl IntoIterator<Item = &'a Performance>) -> Self {
        let AvatarStage { avatar, camera, from, offsets } = stage.clone();
        let placed = performances.into_iter().zip(offsets);
        let placed =
            placed.map(|(performance, offset)| PlacedAvatar { performance, offset: *offset, meshes: Vec::new() });
        let size = camera.size;
        Self {
            placed: placed.collect(),
            avatar,
            camera,
            light: Light::studio(from.turn().turn(TO_KEY)),
            backdrop: Background::gradient(size, TOP_COLOUR, BOTTOM_COLOUR),
            renderer: Renderer::new(size),
        }
    }

    pub fn n_triangles(&self) -> usize {
        self.avatar.parts.iter().map(|part| part.triangles.len()).sum()
    }

    /// Image of one frame with the mouth opened by `mouth`, 0..1.
    pub fn frame(&mut self, frame_idx: usize, mouth: f64) -> Image {
        for PlacedAvatar { performance, offset, meshes } in &mut self.placed {
            let Performance { rig, clip, .. } = *performance;
            let root = add(clip.root_at(frame_idx), *offset);
            self.avatar.pose_into(rig, root, &clip.local[frame_idx], mouth, meshes);
        }
        let meshes: Vec<&Mesh> = self.placed.iter().flat_map(|placed| &placed.meshes).collect();
        self.renderer.draw(&self.camera, &meshes, &self.light, &self.backdrop)
    }

    /// Image of one frame over a video frame of the view's size, from the camera of the video.
    pub fn frame_over(&mut self, video_frame: Image, frame_idx: usize, mouth: f64, source: &SourceCamera) -> Image {
        if let Some(PlacedAvatar { performance: Performance { rig, clip, .. }, .. }) = self.placed.first() {
            let neck = clip.positions(frame_idx)[rig.neck];
            self.camera = source.at(clip.fps.secs(frame_idx), neck, self.camera.size);
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::animate::performance::AnimationReport;
    use crate::animate::rig::rig::tests::default_rig;
    use orator_base::types::time::FrameRate;
    use orator_formats::bvh::write::BvhClip;

    const SIZE: [usize; 2] = [500, 180];

    /// Performance with the arms down whose head is pitched forward by these angles, radians.
    fn nodding(pitches: &[f64]) -> Performance {
        let rig = default_rig();
        let pose = |pitch: &f64| {
            let mut local = vec![Rotation::IDENTITY; rig.skeleton.joints.len()];
            for arm in &rig.arms {
                local[arm.upper] = Rotation::about([0.0, 0.0, -arm.sign], 1.3);
            }
            local[rig.head] = Rotation::about([1.0, 0.0, 0.0], *pitch);
            local
        };
        let local: Vec<Vec<Rotation>> = pitches.iter().map(pose).collect();
        let (skeleton, fps) = (rig.skeleton.clone(), FrameRate::new(30, 1));
        let clip = BvhClip { skeleton, fps, root: rig.root, travel: Vec::new(), local };
        Performance { rig, clip, report: AnimationReport::default() }
    }

    #[test]
    fn no_pixel_of_two_avatars_shows_a_head() {
        let (left, right) = (nodding(&[0.0, 0.5]), nodding(&[-0.4, 0.0]));
        let stage = AvatarStage::side_by_side(&[&left, &right], &Appearance::faceless(), SIZE).unwrap();
        let mut painted = stage.clone();
        let mut n_painted = 0;
        for part in &mut painted.avatar.parts {
            for (colour, weights) in part.colours.iter_mut().zip(&part.weights) {
                if weights[0].0 == left.rig.head {
                    *colour = [1.0, 0.0, 0.0];
                    n_painted += 1;
                }
            }
        }
        assert!(n_painted > 1000, "{n_painted} vertices");
        let images = |stage: &AvatarStage| {
            let mut view = AvatarView::on(stage, [&left, &right]);
            [view.frame(0, 0.0), view.frame(1, 0.0)]
        };
        assert!(images(&stage) == images(&painted), "a head is visible");
        for (performance, offset) in [&left, &right].into_iter().zip(PAIR) {
            for frame_idx in 0..2 {
                let chin = add(performance.clip.positions(frame_idx)[performance.rig.head], offset);
                let [_, y] = stage.camera.pixel(stage.camera.to_camera_axes(chin));
                assert!((-40.0..-0.5).contains(&y), "{y}");
            }
        }
        // The lowest head is directly above the top edge: a slightly higher camera shows it.
        let raised = [stage, painted].map(|mut stage| {
            stage.camera.position[1] += 4.0 * ABOVE_TOP_CM;
            images(&stage)
        });
        assert!(raised[0] != raised[1], "the top edge is too low");
    }

    #[test]
    fn two_avatars_are_visible_a_metre_and_a_half_apart() {
        let still = nodding(&[0.0]);
        let stage = AvatarStage::side_by_side(&[&still], &Appearance::faceless(), SIZE).unwrap();
        let image = AvatarView::on(&stage, [&still, &still]).frame(0, 0.0);
        assert_eq!([image.width, image.height], SIZE);
        let is_body = |x: usize, y: usize| image.pixel(x, y) != image.pixel(0, y);
        for y in 0..SIZE[1] {
            assert!(!is_body(250, y) && !is_body(499, y), "row {y}");
        }
        let columns = |x: std::ops::Range<usize>, rows: usize| -> Vec<f64> {
            let px = (0..rows).flat_map(|y| x.clone().map(move |x| (x, y)));
            px.filter(|(x, y)| is_body(*x, *y)).map(|(x, _)| x as f64).collect()
        };
        let halves = [columns(0..250, SIZE[1]), columns(250..500, SIZE[1])];
        assert!(halves.iter().all(|half| half.len() > 5000), "{:?}", halves.map(|half| half.len()));
        // Neck and shoulders: 1.5 m of the 2.5 m that 500 px show.
        let [left, right] = [columns(0..250, 20), columns(250..500, 20)];
        let mean = |columns: &[f64]| columns.iter().sum::<f64>() / columns.len() as f64;
        assert!((mean(&right) - mean(&left) - 300.0).abs() < 8.0, "{} and {} px", mean(&left), mean(&right));
    }
}
