//! Skinned meshes of an avatar in an FBX file, one per material.

use super::binary::{FbxNode, FbxValue};
use super::document::{FbxObjects, properties, property};
use crate::animate::avatar::AvatarMesh;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;

#[derive(Clone, Copy, Debug)]
pub struct BoundBones<'a> {
    /// Model id of each joint of the file.
    pub models: &'a [i64],
    /// Joint of the file for each joint of the rig.
    pub of_rig: &'a [usize],
    /// World rotation and position (cm) of each joint of the file at rest.
    pub rest: &'a [(Rotation, Vec3)],
}

pub fn add(objects: &mut FbxObjects, part: &AvatarMesh, bones: BoundBones) -> i64 {
    let name = format!("{:?}", part.material);
    let at_origin = [("Lcl Translation", 0.0), ("Lcl Rotation", 0.0), ("Lcl Scaling", 1.0)];
    let placed = at_origin.map(|(name, v)| property(name, [name, "", "A"], vec![v.into(), v.into(), v.into()]));
    let content = [FbxNode::one("Version", 232), properties(placed), FbxNode::one("Culling", "CullingOff")];
    let model = objects.add("Model", (&name, "Model", "Mesh"), content);
    objects.connect(model, 0);
    let geometry = objects.add("Geometry", (&name, "Geometry", "Mesh"), geometry(part));
    objects.connect(geometry, model);
    let [r, g, b] = part.colours.first().map_or([0.5; 3], |colour| colour.map(f64::from));
    let shown = [
        property("DiffuseColor", ["Color", "", "A"], vec![r.into(), g.into(), b.into()]),
        property("SpecularFactor", ["Number", "", "A"], vec![f64::from(part.material.gloss()).into()]),
    ];
    let content = [FbxNode::one("Version", 102), FbxNode::one("ShadingModel", "phong"), properties(shown)];
    let material = objects.add("Material", (&name, "Material", ""), content);
    objects.connect(material, model);
    let content = [FbxNode::one("Version", 101), FbxNode::one("Link_DeformAcuracy", 50.0)];
    let skin = objects.add("Deformer", (&name, "Deformer", "Skin"), content);
    objects.connect(skin, geometry);
    for rig_joint in 0..bones.of_rig.len() {
        let carried = part.weights.iter().enumerate().flat_map(|(vertex, weights)| {
            let of_joint = weights.iter().filter(|(joint, weight)| *joint == rig_joint && *weight > 0.0);
            of_joint.map(move |(_, weight)| (vertex as i32, *weight))
        });
        let (vertices, weights): (Vec<i32>, Vec<f64>) = carried.unzip();
        if vertices.is_empty() {
            continue;
        }
        let joint = bones.of_rig[rig_joint];
        let (turn, place) = bones.rest[joint];
        let back = turn.inverse();
        let content = [
            FbxNode::one("Version", 100),
            FbxNode::new("UserData", vec!["".into(), "".into()]),
            FbxNode::one("Indexes", FbxValue::Ints(vertices)),
            FbxNode::one("Weights", FbxValue::Doubles(weights)),
            FbxNode::one("Transform", FbxValue::Doubles(matrix(back, back.turn(place.map(|v| 0.0 - v))))),
            FbxNode::one("TransformLink", FbxValue::Doubles(matrix(turn, place))),
        ];
        let cluster = objects.add("Deformer", (&name, "SubDeformer", "Cluster"), content);
        objects.connect(cluster, skin);
        objects.connect(bones.models[joint], cluster);
    }
    model
}

/// Column-major 4 x 4 matrix of a rotation followed by a translation.
pub fn matrix(turn: Rotation, place: Vec3) -> Vec<f64> {
    let [x, y, z] = turn.axes();
    [(x, 0.0), (y, 0.0), (z, 0.0), (place, 1.0)].into_iter().flat_map(|([a, b, c], d)| [a, b, c, d]).collect()
}

fn geometry(part: &AvatarMesh) -> Vec<FbxNode> {
    let flat = |vectors: &[Vec3]| FbxValue::Doubles(vectors.iter().flatten().copied().collect());
    // The last corner of a polygon is stored as its bitwise complement.
    let corners = part.triangles.iter().flat_map(|&[a, b, c]| [a as i32, b as i32, !(c as i32)]);
    let colours = part.colours.iter().flat_map(|&[r, g, b]| [r, g, b, 1.0]).map(f64::from).collect();
    let layer = |kind: &'static str, mapping: &str, reference: &str, content: FbxNode| {
        FbxNode::one(kind, 0).with([
            FbxNode::one("Version", 101),
            FbxNode::one("Name", ""),
            FbxNode::one("MappingInformationType", mapping),
            FbxNode::one("ReferenceInformationType", reference),
            content,
        ])
    };
    let entry = |kind: &str| {
        FbxNode::new("LayerElement", vec![]).with([FbxNode::one("Type", kind), FbxNode::one("TypedIndex", 0)])
    };
    let kinds = ["LayerElementNormal", "LayerElementColor", "LayerElementMaterial"];
    let materials = FbxNode::one("Materials", FbxValue::Ints(vec![0]));
    vec![
        FbxNode::one("Vertices", flat(&part.points)),
        FbxNode::one("PolygonVertexIndex", FbxValue::Ints(corners.collect())),
        FbxNode::one("GeometryVersion", 124),
        layer(kinds[0], "ByVertice", "Direct", FbxNode::one("Normals", flat(&part.normals))),
        layer(kinds[1], "ByVertice", "Direct", FbxNode::one("Colors", FbxValue::Doubles(colours))),
        layer(kinds[2], "AllSame", "IndexToDirect", materials),
        FbxNode::one("Layer", 0).with([FbxNode::one("Version", 100)]).with(kinds.map(entry)),
    ]
}
