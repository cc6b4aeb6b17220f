//! Ground truth of an actor in the image, exact from rig and camera, and the visibility of each point.

use super::actor::{Actor, ActorPose};
use crate::rendered_truth::{RenderedTruth, Visibility};
use ndarray::{Array1, Array2, Array3, s};
use orator_avatar::render::{PinholeCamera, Renderer};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale, sub};
use orator_base::types::pose2d::{N_BODY, N_HAND};
use orator_base::types::skeleton::{L_HAND, L_SHOULDER, N_JOINTS, NECK, R_HAND, R_SHOULDER};
use orator_base::types::time::FrameRate;

/// Number of points of a frame: body, left hand, right hand.
pub const N_POINTS: usize = N_BODY + 2 * N_HAND;

/// Rig joints that a point belongs to, and its depth below the surface.
#[derive(Clone, Debug)]
struct PointOwner {
    joints: Vec<usize>,
    /// Radius of the clothed limb plus a margin, cm of a body of unit 1.
    depth: f64,
    /// Hand of the point: 0 left, 1 right, `None` for the body.
    hand: Option<usize>,
}

/// Owners of all points of an actor.
pub struct PointOwners {
    owners: Vec<PointOwner>,
    /// Hand (0 left, 1 right) of each rig joint.
    hand_of: Vec<Option<usize>>,
    unit: f64,
}

/// Ground truth of one frame.
#[derive(Clone, Debug)]
pub struct FrameTruth {
    pub px: [[f64; 2]; N_POINTS],
    pub seen: [Visibility; N_POINTS],
    /// Joints, and points of the body, in camera axes, metres.
    joints: [Vec3; N_JOINTS],
    body: [Vec3; N_BODY],
    /// Yaw, pitch and roll of the head, degrees.
    head: Vec3,
    mouth: f64,
}

impl PointOwners {
    pub fn new(actor: &Actor) -> Self {
        let rig = &actor.rig;
        let joints = &rig.skeleton.joints;
        let mut hand_of = vec![None; joints.len()];
        for joint in 0..joints.len() {
            let side = rig.arms.iter().position(|arm| arm.hand == joint);
            hand_of[joint] = side.or(joints[joint].parent.and_then(|parent| hand_of[parent]));
        }
        let near = |joint: usize| -> Vec<usize> {
            let parent = joints[joint].parent;
            let all = 0..joints.len();
            all.filter(|&other| {
                let of = joints[other].parent;
                other == joint
                    || Some(other) == parent
                    || of == Some(joint)
                    || (of == parent && hand_of[joint].is_some())
            })
            .collect()
        };
        let head = vec![rig.head, rig.neck];
        let find = |name: &str| rig.skeleton.find(name).unwrap_or_default();
        let trunk = [0, rig.spine, rig.chest];
        let mut owners: Vec<PointOwner> =
            [2.0, 2.0, 2.0, 4.5, 4.5].map(|depth| PointOwner { joints: head.clone(), depth, hand: None }).into();
        let body = |names: [&str; 2], depth: f64, more: &[usize]| {
            names.map(|name| {
                let mut joints = near(find(name));
                joints.extend(more);
                PointOwner { joints, depth, hand: None }
            })
        };
        let clavicles = [rig.arms[0].clavicle, rig.arms[1].clavicle, rig.chest, rig.neck];
        owners.extend(body(["LeftArm", "RightArm"], 13.0, &clavicles));
        owners.extend(body(["LeftForeArm", "RightForeArm"], 12.0, &[]));
        owners.extend(body(["LeftHand", "RightHand"], 6.5, &[]));
        owners.extend(body(["LeftUpLeg", "RightUpLeg"], 18.0, &trunk));
        owners.extend(body(["LeftLeg", "RightLeg"], 11.0, &[]));
        owners.extend(body(["LeftFoot", "RightFoot"], 9.0, &[]));
        for (side, root) in [L_HAND, R_HAND].into_iter().enumerate() {
            for point in 0..N_HAND {
                let joint = rig.positions[root + point];
                let depth = if point == 0 { 6.0 } else { 3.0 };
                owners.push(PointOwner { joints: near(joint), depth, hand: Some(side) });
            }
        }
        Self { owners, hand_of, unit: actor.unit }
    }

    /// Visibility of a point at `depth` (cm); `front` is the mesh, label and depth of the foremost surface at its
    /// pixel. Mesh counts: those of the first actor's body (`n_body`), with the held object (`n_own`), and of all
    /// persons (`n_persons`).
    fn visibility(
        &self,
        point: usize,
        depth: f64,
        front: Option<(usize, u16, f64)>,
        [n_body, n_own, n_persons]: [usize; 3],
    ) -> Visibility {
        let owner = &self.owners[point];
        let Some((mesh, label, front)) = front else { return Visibility::Visible };
        let depth_behind_front = depth - front;
        if depth_behind_front <= 0.0 {
            return Visibility::Visible;
        }
        if mesh >= n_body {
            let things = (n_body..n_own).contains(&mesh) || mesh >= n_persons;
            return if things { Visibility::BehindObject } else { Visibility::BehindPerson };
        }
        let label = usize::from(label);
        if owner.joints.contains(&label) && depth_behind_front < owner.depth * self.unit {
            return Visibility::Visible;
        }
        match self.hand_of.get(label).copied().flatten() {
            Some(side) if owner.hand != Some(side) => Visibility::BehindHand,
            _ => Visibility::BehindBody,
        }
    }
}

/// Numbers of meshes of a drawn frame: the first actor's body, the same with its held object, all persons.
pub type MeshCounts = [usize; 3];

impl FrameTruth {
    /// Ground truth of an actor's pose, for the frame that the renderer drew last.
    pub fn of(
        actor: &Actor,
        owners: &PointOwners,
        pose: &ActorPose,
        camera: &PinholeCamera,
        drawn: (&Renderer, MeshCounts),
    ) -> Self {
        let rig = &actor.rig;
        let positions = rig.skeleton.positions(pose.root, &pose.local);
        let world = points(actor, pose, &positions);
        let (renderer, counts) = drawn;
        let seen = world.map(|at| camera.to_camera_axes(at));
        let px = seen.map(|at| camera.pixel(at));
        let [width, height] = camera.size.map(|n| n as f64 - 0.5);
        let visible = std::array::from_fn(|point| {
            let [x, y] = px[point];
            if !(-0.5..width).contains(&x) || !(-0.5..height).contains(&y) {
                return Visibility::Outside;
            }
            owners.visibility(point, seen[point][2], renderer.label_at(px[point]), counts)
        });
        let joints = rig.positions.map(|joint| scale(camera.to_camera_axes(positions[joint]), 0.01));
        let head = head_degrees(camera.axes * rig.skeleton.world(&pose.local)[rig.head]);
        let body = std::array::from_fn(|point| scale(seen[point], 0.01));
        Self { px, seen: visible, joints, body, head, mouth: pose.mouth }
    }
}

/// World positions of the points in the order of the truth, cm.
fn points(actor: &Actor, pose: &ActorPose, positions: &[Vec3]) -> [Vec3; N_POINTS] {
    let rig = &actor.rig;
    let turn = rig.skeleton.world(&pose.local)[rig.head];
    let face = actor.face.map(|point| add(positions[rig.head], turn.turn(point)));
    let leg = |name: &str| rig.skeleton.find(name).map_or([0.0; 3], |joint| positions[joint]);
    let [left, right] =
        [L_SHOULDER, R_SHOULDER].map(|shoulder| [0, 1, 2].map(|k| positions[rig.positions[shoulder + k]]));
    let mut all = Vec::with_capacity(N_POINTS);
    all.extend(face);
    for k in 0..3 {
        all.extend([left[k], right[k]]);
    }
    for name in ["LeftUpLeg", "RightUpLeg", "LeftLeg", "RightLeg", "LeftFoot", "RightFoot"] {
        all.push(leg(name));
    }
    for root in [L_HAND, R_HAND] {
        all.extend((0..N_HAND).map(|point| positions[rig.positions[root + point]]));
    }
    std::array::from_fn(|point| all[point])
}

/// Yaw to the person's left, pitch up and roll to the left shoulder of a head, from its rotation in camera axes,
/// degrees.
fn head_degrees(head: Rotation) -> Vec3 {
    // Half a turn about x maps the rig's axes (y up, facing +z) to those of a camera that it faces.
    let facing = Rotation::about([1.0, 0.0, 0.0], std::f64::consts::PI);
    let turned = facing.inverse() * head;
    let [_, _, ahead] = turned.axes();
    let (yaw, pitch) = (ahead[0].atan2(ahead[2]), ahead[1].clamp(-1.0, 1.0).asin());
    let upright = Rotation::about([0.0, 1.0, 0.0], yaw) * Rotation::about([1.0, 0.0, 0.0], -pitch);
    let [left, _, _] = (upright.inverse() * turned).axes();
    [yaw.to_degrees(), pitch.to_degrees(), -left[1].atan2(left[0]).to_degrees()]
}

/// Joins the frames of a clip to its ground truth.
pub fn collected(frames: &[FrameTruth], fps: FrameRate, camera: &PinholeCamera, speaks: bool) -> RenderedTruth {
    let n = frames.len();
    let px = Array3::from_shape_fn((n, N_POINTS, 2), |(t, point, k)| frames[t].px[point][k] as f32);
    let seen = Array2::from_shape_fn((n, N_POINTS), |(t, point)| frames[t].seen[point]);
    let part = |from: usize, n: usize| {
        (px.slice(s![.., from..from + n, ..]).to_owned(), seen.slice(s![.., from..from + n]).to_owned())
    };
    let (body, body_visibility) = part(0, N_BODY);
    let (left_hand, left_hand_visibility) = part(N_BODY, N_HAND);
    let (right_hand, right_hand_visibility) = part(N_BODY + N_HAND, N_HAND);
    let neck = |t: usize| frames[t].joints[NECK];
    RenderedTruth {
        fps,
        body,
        body_visibility,
        left_hand,
        left_hand_visibility,
        right_hand,
        right_hand_visibility,
        joints: Array3::from_shape_fn((n, N_JOINTS, 3), |(t, joint, k)| {
            sub(frames[t].joints[joint], neck(t))[k] as f32
        }),
        body_joints: Array3::from_shape_fn((n, N_BODY, 3), |(t, point, k)| {
            sub(frames[t].body[point], neck(t))[k] as f32
        }),
        neck: Array2::from_shape_fn((n, 3), |(t, k)| neck(t)[k] as f32),
        focal_px: camera.focal_px as f32,
        up: camera.axes.turn([0.0, 1.0, 0.0]).map(|v| v as f32),
        head: Array2::from_shape_fn((n, 3), |(t, k)| frames[t].head[k] as f32),
        mouth: Array1::from_shape_fn(n, |t| frames[t].mouth as f32),
        speaks: Array1::from_elem(n, speaks),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_that_faces_the_camera_is_at_zero_and_its_angles_have_their_signs() {
        let camera = PinholeCamera::looking_at([640, 480], 700.0, [0.0, 140.0, 200.0], [0.0, 140.0, 0.0], 0.0);
        let degrees =
            |axis: Vec3, degrees: f64| head_degrees(camera.axes * Rotation::about(axis, degrees.to_radians()));
        let close = |found: Vec3, expected: Vec3| {
            assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 1e-9), "{found:?} {expected:?}");
        };
        close(degrees([0.0, 1.0, 0.0], 0.0), [0.0; 3]);
        close(degrees([0.0, 1.0, 0.0], 30.0), [30.0, 0.0, 0.0]);
        // A rotation about x takes y to z: the face looks down; about z it takes x to y: the left ear rises.
        close(degrees([1.0, 0.0, 0.0], 20.0), [0.0, -20.0, 0.0]);
        close(degrees([0.0, 0.0, 1.0], 10.0), [0.0, 0.0, -10.0]);
    }
}
