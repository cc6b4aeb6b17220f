//! A performance as an FBX scene: joints as limb nodes in T-pose (cm, y up, facing +z) with their bind pose, the avatar
//! as skinned meshes, and the clip as one animation.

use super::binary::{self, FbxNode, FbxValue};
use super::curves;
use super::document::{FbxObjects, properties, property};
use super::mesh::{self, BoundBones};
use crate::animate::avatar::Avatar;
use crate::animate::rig::file_skeleton::{FileSkeleton, RestAxes};
use crate::animate::rig::names::Names;
use crate::animate::rig::rig::Rig;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;
use orator_formats::bvh::write::BvhClip;

/// Bytes of the FBX file of a clip on its rig, with `avatar` as its skin.
pub fn file(rig: &Rig, clip: &BvhClip, avatar: &Avatar, names: Names) -> Vec<u8> {
    let skeleton = FileSkeleton::new(&rig.skeleton, names, RestAxes::Convention);
    let places = skeleton.rest_positions(clip.root);
    let rest: Vec<(Rotation, Vec3)> = skeleton.rest.iter().copied().zip(places).collect();
    let mut objects = FbxObjects::new();
    let models = add_bones(&mut objects, &skeleton, clip.root);
    let bones = BoundBones { models: &models, of_rig: &skeleton.of_rig, rest: &rest };
    let meshes: Vec<i64> = avatar.parts.iter().map(|part| mesh::add(&mut objects, part, bones)).collect();
    let bound = models.iter().zip(&rest).map(|(&model, &(turn, place))| (model, mesh::matrix(turn, place)));
    let unmoved = || mesh::matrix(Rotation::IDENTITY, [0.0; 3]);
    let bound: Vec<_> = bound.chain(meshes.into_iter().map(|model| (model, unmoved()))).collect();
    let nodes = bound.iter().map(|(model, matrix)| {
        FbxNode::new("PoseNode", vec![])
            .with([FbxNode::one("Node", *model), FbxNode::one("Matrix", FbxValue::Doubles(matrix.clone()))])
    });
    let head = [
        FbxNode::one("Type", "BindPose"),
        FbxNode::one("Version", 100),
        FbxNode::one("NbPoseNodes", bound.len() as i32),
    ];
    objects.add("Pose", ("BindPose", "Pose", "BindPose"), head.into_iter().chain(nodes));
    if clip.n_frames() > 0 {
        curves::add(&mut objects, &skeleton.clip(clip), &models);
    }
    binary::file(&objects.document(clip.fps, clip.n_frames(), curves::TAKE))
}

/// Adds the joints; returns the model id of each.
fn add_bones(objects: &mut FbxObjects, skeleton: &FileSkeleton, root: Vec3) -> Vec<i64> {
    let three = |values: Vec3| values.map(FbxValue::from).to_vec();
    let mut models: Vec<i64> = Vec::with_capacity(skeleton.rest.len());
    for (joint, local) in skeleton.skeleton.joints.iter().zip(skeleton.rest_local()) {
        let at = joint.parent.map_or(root, |_| joint.offset);
        let placed = [
            property("InheritType", ["enum", "", ""], vec![1.into()]),
            property("DefaultAttributeIndex", ["int", "Integer", ""], vec![0.into()]),
            property("Lcl Translation", ["Lcl Translation", "", "A"], three(at)),
            property("Lcl Rotation", ["Lcl Rotation", "", "A"], three(curves::angles(local))),
            property("Lcl Scaling", ["Lcl Scaling", "", "A"], three([1.0; 3])),
        ];
        let content = [
            FbxNode::one("Version", 232),
            properties(placed),
            FbxNode::one("Shading", FbxValue::Bool(true)),
            FbxNode::one("Culling", "CullingOff"),
        ];
        let model = objects.add("Model", (&joint.name, "Model", "LimbNode"), content);
        let size = property("Size", ["double", "Number", ""], vec![1.0.into()]);
        let content = [properties([size]), FbxNode::one("TypeFlags", "Skeleton")];
        let attribute = objects.add("NodeAttribute", (&joint.name, "NodeAttribute", "LimbNode"), content);
        objects.connect(model, joint.parent.map_or(0, |parent| models[parent]));
        objects.connect(attribute, model);
        models.push(model);
    }
    models
}
