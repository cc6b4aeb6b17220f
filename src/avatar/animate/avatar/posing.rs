//! Poses of an avatar by linear blend skinning.

use super::avatar::{Avatar, AvatarMesh};
use crate::animate::rig::rig::Rig;
use crate::render::Mesh;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, sub};

/// Affine map of a joint from the T-pose into the world: the columns of the matrix and the translation.
type JointMap = [[f32; 3]; 4];

/// Number of maps along a forearm.
const N_TWISTS: usize = 9;

/// Maps along a forearm whose twist increases from 0 at the elbow to the hand's twist at the wrist.
struct TwistedForearm {
    joint: usize,
    maps: [JointMap; N_TWISTS],
}

impl TwistedForearm {
    fn new(rig: &Rig, local: &[Rotation], side: usize, maps: &[JointMap], rest: &[Vec3]) -> Self {
        let arm = &rig.arms[side];
        let (_, angle) = local[arm.hand].swing_twist([1.0, 0.0, 0.0]);
        let [x, y, z, shift] = maps[arm.forearm];
        let elbow = rest[arm.forearm].map(|v| v as f32);
        let turned = |step: usize| {
            // The bone is along x, so y and z rotate about the line through the elbow.
            let (sin, cos) = (angle as f32 * step as f32 / (N_TWISTS - 1) as f32).sin_cos();
            let (u, v): ([f32; 3], [f32; 3]) =
                (std::array::from_fn(|k| cos * y[k] + sin * z[k]), std::array::from_fn(|k| cos * z[k] - sin * y[k]));
            let moved = |k: usize| (y[k] - u[k]) * elbow[1] + (z[k] - v[k]) * elbow[2];
            [x, u, v, std::array::from_fn(|k| shift[k] + moved(k))]
        };
        Self { joint: arm.forearm, maps: std::array::from_fn(turned) }
    }

    /// Map at a position along the forearm, 0 .. 1.
    fn at(&self, place: f32) -> JointMap {
        let at = place.clamp(0.0, 1.0) * (N_TWISTS - 1) as f32;
        let (low, share) = ((at as usize).min(N_TWISTS - 2), at - (at as usize).min(N_TWISTS - 2) as f32);
        let (a, b) = (&self.maps[low], &self.maps[low + 1]);
        std::array::from_fn(|c| std::array::from_fn(|k| a[c][k] + share * (b[c][k] - a[c][k])))
    }
}

impl Avatar {
    /// Meshes of a pose in world axes (cm, y up), with the hips at `root`, a local rotation for each joint of the rig,
    /// and the mouth opened by `mouth` (0 closed .. 1 fully open).
    pub fn posed(&self, rig: &Rig, root: Vec3, local: &[Rotation], mouth: f64) -> Vec<Mesh> {
        let mut meshes = Vec::new();
        self.pose_into(rig, root, local, mouth, &mut meshes);
        meshes
    }

    /// Writes the meshes of a pose into `meshes` and reuses their memory.
    pub fn pose_into(&self, rig: &Rig, root: Vec3, local: &[Rotation], mouth: f64, meshes: &mut Vec<Mesh>) {
        let (turns, places) = (rig.skeleton.world(local), rig.skeleton.positions(root, local));
        let rest = rig.skeleton.positions(rig.root, &vec![Rotation::IDENTITY; local.len()]);
        let maps: Vec<JointMap> = (0..turns.len())
            .map(|joint| {
                let [x, y, z] = turns[joint].axes();
                [x, y, z, sub(places[joint], turns[joint].turn(rest[joint]))].map(|column| column.map(|v| v as f32))
            })
            .collect();
        let forearms = [0, 1].map(|side| TwistedForearm::new(rig, local, side, &maps, &rest));
        meshes.resize_with(self.parts.len(), Mesh::default);
        for (part, mesh) in self.parts.iter().zip(meshes) {
            part.pose_into(&maps, &forearms, mouth as f32, mesh);
        }
    }
}

impl AvatarMesh {
    fn pose_into(&self, maps: &[JointMap], forearms: &[TwistedForearm; 2], mouth: f32, mesh: &mut Mesh) {
        mesh.colours.clone_from(&self.colours);
        mesh.triangles.clone_from(&self.triangles);
        (mesh.gloss, mesh.n_closed) = (self.material.gloss(), self.n_closed);
        mesh.labels.clear();
        mesh.labels.extend(self.weights.iter().map(|weights| weights[0].0 as u16));
        mesh.points.clear();
        mesh.normals.clear();
        for (n, weights) in self.weights.iter().enumerate() {
            let mut at = self.points[n].map(|v| v as f32);
            if let Some(open) = self.mouth.get(n) {
                (0..3).for_each(|k| at[k] += mouth * open[k] as f32);
            }
            let normal = self.normals[n].map(|v| v as f32);
            let (mut place, mut out) = ([0.0; 3], [0.0; 3]);
            for &(joint, weight) in weights.iter().take_while(|(_, weight)| *weight > 0.0) {
                let twisted = self.twist.get(n).zip(forearms.iter().find(|forearm| forearm.joint == joint));
                let turned;
                let [x, y, z, shift] = match twisted {
                    None => &maps[joint],
                    Some((&place, forearm)) => {
                        turned = forearm.at(place);
                        &turned
                    }
                };
                let weight = weight as f32;
                for k in 0..3 {
                    place[k] += weight * (x[k] * at[0] + y[k] * at[1] + z[k] * at[2] + shift[k]);
                    out[k] += weight * (x[k] * normal[0] + y[k] * normal[1] + z[k] * normal[2]);
                }
            }
            let length = (out[0] * out[0] + out[1] * out[1] + out[2] * out[2]).sqrt().max(1e-12);
            mesh.points.push(place);
            mesh.normals.push(out.map(|v| v / length));
        }
    }
}
