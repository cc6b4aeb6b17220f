//! Tests of `orator_avatar::animate::avatar::posing`.

use crate::animate::unit::file_skeleton::default_rig;
use orator_avatar::animate::avatar::appearance::{Appearance, Top};
use orator_avatar::animate::avatar::avatar::Avatar;
use orator_avatar::animate::avatar::material::Material;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{norm, sub};

#[test]
fn the_rest_pose_is_the_avatar_and_the_mouth_opens() {
    let rig = default_rig();
    let avatar = Avatar::new(&rig, &Appearance::plain());
    let mut local = vec![Rotation::IDENTITY; rig.skeleton.joints.len()];
    let mut meshes = avatar.posed(&rig, rig.root, &local, 0.0);
    for (part, mesh) in avatar.parts.iter().zip(&meshes) {
        assert_eq!((part.triangles.len(), part.points.len()), (mesh.triangles.len(), mesh.points.len()));
        for (point, posed) in part.points.iter().zip(&mesh.points) {
            assert!(norm(sub(*point, posed.map(f64::from))) < 1e-3);
        }
    }
    // The head turns to its left; the second pose reuses the memory of the first.
    local[rig.head] = Rotation::about([0.0, 1.0, 0.0], 0.5);
    avatar.pose_into(&rig, rig.root, &local, 0.0, &mut meshes);
    assert_eq!(meshes, avatar.posed(&rig, rig.root, &local, 0.0));
    // The mouth opens about the hinge of the jaw.
    let lowered = |mouth: f64| {
        let open = avatar.posed(&rig, rig.root, &local, mouth);
        let points = meshes.iter().zip(&open).flat_map(|(a, b)| a.points.iter().zip(&b.points));
        points.map(|(a, b)| a[1] - b[1]).fold(0.0, f32::max)
    };
    assert!(lowered(0.5) > 1.0 && lowered(1.0) > lowered(0.5) + 1.0 && lowered(1.0) < 4.5, "{}", lowered(1.0));
}

#[test]
fn the_plain_face_is_symmetric() {
    let rig = default_rig();
    let plain = Avatar::new(&rig, &Appearance::plain());
    for material in [Material::Face, Material::Eyes] {
        let part = plain.parts.iter().find(|part| part.material == material).unwrap();
        for point in part.points.iter().step_by(37) {
            let mirror = [-point[0], point[1], point[2]];
            let near = part.points.iter().map(|at| norm(sub(*at, mirror))).fold(f64::INFINITY, f64::min);
            assert!(near < 0.02, "{material:?}: {point:?} has no mirror image, by {near} cm");
        }
    }
}

#[test]
fn a_bare_forearm_keeps_its_girth_when_the_hand_turns_and_bends() {
    let rig = default_rig();
    let appearance = Appearance { top: Top::ShortSleeves, ..Appearance::plain() };
    let avatar = Avatar::new(&rig, &appearance);
    let arm = &rig.arms[0];
    // Mean distance of the skin from the forearm's axis, in slices from its middle to the wrist.
    let girth = |turn: Rotation| {
        let mut local = vec![Rotation::IDENTITY; rig.skeleton.joints.len()];
        local[arm.hand] = turn;
        let places = rig.skeleton.positions(rig.root, &local);
        let (elbow, wrist) = (places[arm.forearm], places[arm.hand]);
        let long = norm(sub(wrist, elbow));
        let meshes = avatar.posed(&rig, rig.root, &local, 0.0);
        [0.5, 0.6, 0.7, 0.8, 0.9].map(|share| {
            let at = |point: &[f32; 3]| sub(point.map(f64::from), elbow);
            let slice = meshes[0].points.iter().map(at).filter(|at| (at[0] / long - share).abs() < 0.04);
            let radii: Vec<f64> = slice.map(|at| at[1].hypot(at[2])).filter(|r| *r < 6.0).collect();
            radii.iter().sum::<f64>() / radii.len() as f64
        })
    };
    let straight = girth(Rotation::IDENTITY);
    for (axis, degrees) in [([1.0, 0.0, 0.0], 85.0), ([1.0, 0.0, 0.0], -85.0), ([0.0, 0.0, -1.0], 60.0)] {
        let bent = girth(Rotation::about(axis, f64::to_radians(degrees)));
        let worst = straight.iter().zip(bent).map(|(a, b)| b / a).fold(1.0, f64::min);
        assert!(worst > 0.9, "{degrees} degrees about {axis:?}: {straight:?} cm become {bent:?}");
    }
}
