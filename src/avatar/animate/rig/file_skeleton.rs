//! Skeleton of a file: the rig's bones under the names of a convention, with additional bones of that convention and
//! its rest axes. Positions equal those of the rig in every frame.

use super::names::Names;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, scale, unit};
use orator_base::motion::fk::{Joint, Skeleton};
use orator_formats::bvh::write::BvhClip;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestAxes {
    /// Parallel to the world axes.
    World,
    /// Those of the convention, if it defines any: in Mixamo, y runs along the bone, so that rotations transfer
    /// directly. World axes for all other conventions.
    Convention,
}

#[derive(Clone, Debug)]
pub struct FileSkeleton {
    /// Joints with the names of the file, bone ends included; offsets in cm in the parent's rest axes.
    pub skeleton: Skeleton,
    /// World rotation of each joint at rest.
    pub rest: Vec<Rotation>,
    /// Index in this skeleton of each joint of the rig.
    pub of_rig: Vec<usize>,
    /// Joint of the rig for each joint of this skeleton; `None` for additional bones, which move with their parent.
    source: Vec<Option<usize>>,
}

/// A joint of the file before indices are assigned.
struct Planned {
    joint: Joint,
    source: Option<usize>,
}

impl FileSkeleton {
    /// Skeleton of `rig` under the names of a convention.
    pub fn new(rig: &Skeleton, names: Names, axes: RestAxes) -> Self {
        let (planned, of_rig) = match names {
            Names::Mixamo => mixamo_joints(rig),
            _ => (rig.joints.iter().enumerate().map(|(n, joint)| from_rig(n, joint.clone())).collect(), identity(rig)),
        };
        let (joints, source): (Vec<Joint>, Vec<_>) = planned.into_iter().map(|p| (p.joint, p.source)).unzip();
        let mut skeleton = Skeleton { joints };
        let rest = match (axes, names) {
            (RestAxes::Convention, Names::Mixamo) => bone_axes(&skeleton),
            _ => vec![Rotation::IDENTITY; skeleton.joints.len()],
        };
        let file_names = names.of(&skeleton);
        for (joint, name) in skeleton.joints.iter_mut().zip(file_names) {
            joint.name = name;
            if let Some(parent) = joint.parent {
                joint.offset = rest[parent].inverse().turn(joint.offset);
            }
        }
        Self { skeleton, rest, of_rig, source }
    }

    /// Local rotation of every joint at rest.
    pub fn rest_local(&self) -> Vec<Rotation> {
        let own = |(joint, &rest): (&Joint, &Rotation)| {
            joint.parent.map_or(rest, |parent| self.rest[parent].inverse() * rest)
        };
        self.skeleton.joints.iter().zip(&self.rest).map(own).collect()
    }

    pub fn clip(&self, clip: &BvhClip) -> BvhClip {
        let turned = |local: &Vec<Rotation>| -> Vec<Rotation> {
            let joint = |(n, joint): (usize, &Joint)| {
                let before = joint.parent.map_or(Rotation::IDENTITY, |parent| self.rest[parent]);
                let moved = self.source[n].filter(|_| !joint.end).map_or(Rotation::IDENTITY, |rig| local[rig]);
                let is_plain = before == Rotation::IDENTITY && self.rest[n] == Rotation::IDENTITY;
                // The product is skipped so that not even the sign of a zero changes.
                if is_plain { moved } else { before.inverse() * moved * self.rest[n] }
            };
            self.skeleton.joints.iter().enumerate().map(joint).collect()
        };
        BvhClip {
            skeleton: self.skeleton.clone(),
            fps: clip.fps,
            root: clip.root,
            travel: clip.travel.clone(),
            local: clip.local.iter().map(turned).collect(),
        }
    }

    /// Positions of the joints at rest, with the root at `root`.
    pub fn rest_positions(&self, root: Vec3) -> Vec<Vec3> {
        self.skeleton.positions(root, &self.rest_local())
    }
}

fn identity(rig: &Skeleton) -> Vec<usize> {
    (0..rig.joints.len()).collect()
}

fn from_rig(source: usize, joint: Joint) -> Planned {
    Planned { joint, source: Some(source) }
}

/// The rig's joints with Mixamo's additional bones: `Spine2`, half way from our chest to the neck, which carries the
/// neck and the shoulders, and the ends of the toes.
fn mixamo_joints(rig: &Skeleton) -> (Vec<Planned>, Vec<usize>) {
    let (chest, neck) = (rig.find("Chest"), rig.find("Neck"));
    let mut planned: Vec<Planned> = Vec::with_capacity(rig.joints.len() + 3);
    let mut of_rig = Vec::with_capacity(rig.joints.len());
    let mut upper_chest: Option<(usize, Vec3)> = None;
    for (n, joint) in rig.joints.iter().enumerate() {
        let mut joint = joint.clone();
        let foot = joint.parent.filter(|_| joint.end).map(|parent| rig.joints[parent].name.clone());
        joint.parent = joint.parent.map(|parent| of_rig[parent]);
        if let (Some(chest), Some(neck)) = (chest, neck)
            && rig.joints[n].parent == Some(chest)
        {
            let (at, half) = *upper_chest.get_or_insert_with(|| {
                let half = scale(rig.joints[neck].offset, 0.5);
                let spine = Joint { name: "Spine2".to_owned(), parent: Some(of_rig[chest]), offset: half, end: false };
                planned.push(Planned { joint: spine, source: None });
                (planned.len() - 1, half)
            });
            joint.parent = Some(at);
            joint.offset = orator_base::math::vec3::sub(joint.offset, half);
        }
        of_rig.push(planned.len());
        let side = foot.as_deref().and_then(|foot| foot.strip_suffix("Foot")).map(str::to_owned);
        let Some(side) = side else {
            planned.push(from_rig(n, joint));
            continue;
        };
        let [_, _, ahead] = joint.offset;
        let base = Joint { name: format!("{side}ToeBase"), end: false, ..joint };
        planned.push(from_rig(n, base));
        let end = Joint { name: String::new(), parent: Some(of_rig[n]), offset: [0.0, 0.0, 0.4 * ahead], end: true };
        planned.push(Planned { joint: end, source: None });
    }
    (planned, of_rig)
}

/// World rotations of Mixamo's joints in T-pose. y runs along the bone; the rotation about it is that of the trunk, arm
/// or leg axes: x points backwards in the left arm, forwards in the right arm, and to the character's right in the legs
/// (pre-rotations of Mixamo's skeleton as in the walkTools of D. Wooldridge, 2014).
fn bone_axes(skeleton: &Skeleton) -> Vec<Rotation> {
    let mut axes: Vec<Rotation> = Vec::with_capacity(skeleton.joints.len());
    for (n, joint) in skeleton.joints.iter().enumerate() {
        if let (true, Some(parent)) = (joint.end, joint.parent) {
            axes.push(axes[parent]);
            continue;
        }
        let part = limb_axes(&joint.name);
        let mut children = skeleton.children(n);
        let along = match (children.next(), children.next()) {
            (Some(child), None) if part != Rotation::IDENTITY => unit(skeleton.joints[child].offset, 1e-9),
            _ => None,
        };
        let [_, y, _] = part.axes();
        axes.push(along.map_or(part, |along| Rotation::between(y, along) * part));
    }
    axes
}

/// Axes of a limb that hangs or reaches out straight; the identity for the trunk.
fn limb_axes(own: &str) -> Rotation {
    let is_of = |parts: &[&str]| parts.iter().any(|part| own.contains(part));
    let left = own.starts_with("Left");
    if is_of(&["UpLeg", "Leg", "Foot", "Toe"]) {
        return Rotation::from_axes([-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]);
    }
    if is_of(&["Shoulder", "Arm", "Hand"]) {
        let sign = if left { 1.0 } else { -1.0 };
        return Rotation::from_axes([0.0, 0.0, -sign], [sign, 0.0, 0.0], [0.0, -1.0, 0.0]);
    }
    Rotation::IDENTITY
}
