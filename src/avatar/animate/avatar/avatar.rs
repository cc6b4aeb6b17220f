//! Skinned avatar of a rig. Its shape is a signed distance field around the bones in a relaxed stance; the surface
//! mesh, the skinning weights and the T-pose vertices (by inverse linear blend skinning) are derived from it.

use super::appearance::{Appearance, Reflectance};
use super::assembly::{Assembly, PosedMesh};
use super::body::BodyForm;
use super::hand::HandForm;
use super::head::HeadForm;
use super::material::Material;
use super::skin::Weights;
use super::stance::Stance;
use super::surface::Surface;
use crate::animate::rig::rig::Rig;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, cross, dot, sub, unit};

/// Mesh of one material in the T-pose (cm, in the rig's axes, soles at y = 0), with skinning weights.
#[derive(Clone, Debug)]
pub struct AvatarMesh {
    pub material: Material,
    pub points: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub colours: Vec<Reflectance>,
    pub triangles: Vec<[u32; 3]>,
    /// The first `n_closed` triangles form closed surfaces.
    pub n_closed: usize,
    /// Four joints per vertex with weights that sum to 1, largest first.
    pub weights: Vec<Weights>,
    /// Displacement of each vertex when the mouth is fully open, cm; empty if no vertex moves.
    pub mouth: Vec<Vec3>,
    /// Position of each vertex along a bare forearm, 0 (elbow) .. 1 (wrist), which sets how far it turns with the hand;
    /// empty if no forearm is bare.
    pub twist: Vec<f32>,
}

#[derive(Clone, Debug)]
pub struct Avatar {
    pub parts: Vec<AvatarMesh>,
}

impl Avatar {
    pub fn new(rig: &Rig, appearance: &Appearance) -> Self {
        let stance = Stance::new(rig);
        let hands = [0, 1].map(|side| HandForm::new(rig, &stance, side));
        let body = BodyForm::new(rig, &stance, hands.each_ref().map(|hand| hand.scale), appearance);
        let head = HeadForm::new(rig, &stance, appearance);
        let meshes = Assembly::new(&body, &head, &hands).meshes;
        let parts = meshes.into_iter().map(|(material, mesh)| AvatarMesh::to_t_pose(material, mesh, &stance)).collect();
        Self { parts }
    }
}

impl AvatarMesh {
    /// Maps a mesh from the stance to the T-pose; linear blend skinning with the stance restores it exactly.
    fn to_t_pose(material: Material, mesh: PosedMesh, stance: &Stance) -> Self {
        let n_closed = mesh.surface.n_closed();
        let Surface { points, normals, triangles } = mesh.surface;
        let (points, normals): (Vec<Vec3>, Vec<Vec3>) = points
            .into_iter()
            .zip(normals)
            .zip(&mesh.weights)
            .map(|((point, normal), weights)| {
                let turn = Blend::new(stance, weights);
                // point = sum of w (R (rest - rest joint) + joint)
                let rest = turn.apply_inverse(sub(point, turn.shift));
                (rest, unit(turn.apply_inverse(normal), 1e-9).unwrap_or(normal))
            })
            .unzip();
        let PosedMesh { colours, weights, mut mouth, mut twist, .. } = mesh;
        if !mouth.is_empty() {
            mouth.resize(points.len(), [0.0; 3]);
        }
        if !twist.is_empty() {
            twist.resize(points.len(), 0.0);
        }
        Self { material, points, normals, colours, triangles, n_closed, weights, mouth, twist }
    }
}

/// The affine map of linear blend skinning at one vertex.
struct Blend {
    /// Columns of the 3 x 3 matrix.
    columns: [Vec3; 3],
    shift: Vec3,
}

impl Blend {
    fn new(stance: &Stance, weights: &Weights) -> Self {
        let mut blend = Self { columns: [[0.0; 3]; 3], shift: [0.0; 3] };
        for &(joint, weight) in weights {
            let turn: Rotation = stance.world[joint];
            let part = |a: Vec3| a.map(|v| v * weight);
            for (column, axis) in blend.columns.iter_mut().zip(turn.axes()) {
                *column = add(*column, part(axis));
            }
            blend.shift = add(blend.shift, part(sub(stance.positions[joint], turn.turn(stance.rest[joint]))));
        }
        blend
    }

    /// Applies the inverse of the linear part (Cramer's rule).
    fn apply_inverse(&self, a: Vec3) -> Vec3 {
        let [x, y, z] = self.columns;
        let volume = dot(x, cross(y, z));
        [dot(a, cross(y, z)) / volume, dot(x, cross(a, z)) / volume, dot(x, cross(y, a)) / volume]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::animate::rig::rig::tests::default_rig;
    use orator_base::math::vec3::{norm, scale};

    #[test]
    fn skinning_maps_the_rest_into_the_stance_and_both_sides_match() {
        let rig = default_rig();
        let (avatar, stance) = (Avatar::new(&rig, &Appearance::plain()), Stance::new(&rig));
        let shirt = &avatar.parts[1];
        let hands = [0, 1].map(|side| HandForm::new(&rig, &stance, side).scale);
        let appearance = Appearance::plain();
        let body = BodyForm::new(&rig, &stance, hands, &appearance);
        let form = body.shirt();
        let cuffs = [0, 1].map(|side| body.cuff(side));
        let mut far = 0;
        for (&point, weights) in shirt.points.iter().zip(&shirt.weights) {
            assert!((weights.iter().map(|w| w.1).sum::<f64>() - 1.0).abs() < 1e-9);
            let turn = Blend::new(&stance, weights);
            let mut at = turn.shift;
            (0..3).for_each(|k| at = add(at, turn.columns[k].map(|v| v * point[k])));
            let off = cuffs.iter().map(|cuff| cuff.distance(at).abs()).fold(form(at).abs(), f64::min);
            far += usize::from(off > 0.05);
        }
        assert!(far < shirt.points.len() / 100, "{far} of {} vertices are off the form", shirt.points.len());
        let side =
            |sign: f64| avatar.parts.iter().flat_map(|part| &part.points).filter(|p| sign * p[0] > 1.0).count() as f64;
        assert!((side(1.0) / side(-1.0) - 1.0).abs() < 0.01, "{} {}", side(1.0), side(-1.0));
    }

    #[test]
    fn bent_joints_do_not_collapse() {
        // Minimum thickness around a finger's middle joint and around an elbow, straight and bent by 90 degrees.
        let rig = default_rig();
        let avatar = Avatar::new(&rig, &Appearance::plain());
        let arm = &rig.arms[0];
        let finger = super::super::stance::finger_joints(&rig, 0, 2);
        for (part, joint, next, axis) in [
            (&avatar.parts[0], finger[1], finger[2], [0.0, 0.0, -1.0]),
            (&avatar.parts[1], arm.forearm, arm.hand, [0.0, -1.0, 0.0]),
        ] {
            let thickness = |degrees: f64| {
                let mut local = vec![Rotation::IDENTITY; rig.skeleton.joints.len()];
                local[joint] = Rotation::about(axis, f64::to_radians(degrees));
                let world = rig.skeleton.world(&local);
                let positions = rig.skeleton.positions(rig.root, &local);
                let rest = rig.skeleton.positions(rig.root, &vec![Rotation::IDENTITY; local.len()]);
                // Distance from the joint to the skin on the stretched side of the bend.
                let half = Rotation::about(axis, f64::to_radians(degrees / 2.0));
                let along = unit(sub(rest[next], rest[joint]), 0.0).unwrap();
                let out = half.turn(cross(along, axis));
                let mut reach: f64 = 0.0;
                for (&point, weights) in part.points.iter().zip(&part.weights) {
                    let at = weights.iter().fold([0.0; 3], |sum, &(j, w)| {
                        add(sum, scale(add(world[j].turn(sub(point, rest[j])), positions[j]), w))
                    });
                    let from = sub(at, positions[joint]);
                    if norm(from) < 8.0 && norm(sub(from, scale(out, dot(from, out)))) < 0.7 * dot(from, out) {
                        reach = reach.max(dot(from, out));
                    }
                }
                reach
            };
            let (straight, bent) = (thickness(0.0), thickness(90.0));
            // Linear blend skinning retains a factor of 0.71 at a right angle; a collapsed joint would be far below.
            assert!(bent > 0.6 * straight && straight > 0.0, "{straight} cm straight, {bent} cm bent");
        }
    }
}
