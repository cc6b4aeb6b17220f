//! The GLB read back without any library: its nodes and animation give the joints of the performance, its skin at rest
//! gives the mesh back, and the mesh is a whole skin. The Khronos validator finds nothing (`make validator`).

use crate::fixtures::figures::{FPS, swinging};
use orator::animate::export::file::{ExportContent, ExportFormat};
use orator::animate::rig::names::Names;
use orator::animate::{AnimationOptions, Performance, perform};
use orator::math::rotation::Rotation;
use orator::math::vec3::{Vec3, add, norm, scale, sub};
use orator::stage::progress::Silent;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A GLB file taken apart.
pub struct Glb {
    pub scene: Value,
    bytes: Vec<u8>,
}

impl Glb {
    pub fn read(path: &Path) -> Self {
        let file = std::fs::read(path).unwrap();
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&file[..4], word(4), word(8)), (b"glTF".as_slice(), 2, file.len()));
        let json = word(12);
        assert_eq!((&file[16..20], &file[24 + json..28 + json]), (b"JSON".as_slice(), b"BIN\0".as_slice()));
        assert_eq!(28 + json + word(20 + json), file.len());
        Self { scene: serde_json::from_slice(&file[20..20 + json]).unwrap(), bytes: file[28 + json..].to_vec() }
    }

    /// Numbers of an accessor, a vector each.
    pub fn numbers(&self, accessor: &Value) -> Vec<Vec<f64>> {
        let accessor = &self.scene["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &self.scene["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let [offset, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        let bytes = &self.bytes[offset..offset + length];
        let n = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            other => panic!("{other}"),
        };
        let flat: Vec<f64> = match accessor["componentType"].as_u64().unwrap() {
            5121 => bytes.iter().map(|&v| f64::from(v)).collect(),
            5123 => bytes.chunks_exact(2).map(|v| f64::from(u16::from_le_bytes(v.try_into().unwrap()))).collect(),
            5125 => bytes.chunks_exact(4).map(|v| f64::from(u32::from_le_bytes(v.try_into().unwrap()))).collect(),
            5126 => bytes.chunks_exact(4).map(|v| f64::from(f32::from_le_bytes(v.try_into().unwrap()))).collect(),
            other => panic!("{other}"),
        };
        assert_eq!(flat.len(), n * accessor["count"].as_u64().unwrap() as usize);
        flat.chunks_exact(n).map(<[f64]>::to_vec).collect()
    }

    fn node(&self, node: usize) -> &Value {
        &self.scene["nodes"][node]
    }

    /// World rotation and place of every node below node 0, metres, under local rotations and the root's place.
    pub fn world(&self, local: &[Rotation], root: Vec3) -> Vec<(Rotation, Vec3)> {
        let mut world = vec![(Rotation::IDENTITY, [f64::NAN; 3]); self.scene["nodes"].as_array().unwrap().len()];
        world[0] = (local[0], root);
        let mut ahead = vec![0];
        while let Some(node) = ahead.pop() {
            for child in self.node(node)["children"].as_array().into_iter().flatten() {
                let child = child.as_u64().unwrap() as usize;
                let offset = vec3(&self.node(child)["translation"]);
                let (turn, place) = world[node];
                world[child] = (turn * local[child], add(place, turn.turn(offset)));
                ahead.push(child);
            }
        }
        world
    }

    /// Local rotations of all nodes in a frame, and the root's place.
    pub fn pose(&self, frame: usize) -> (Vec<Rotation>, Vec3) {
        let animation = &self.scene["animations"][0];
        let mut local = vec![Rotation::IDENTITY; self.scene["nodes"].as_array().unwrap().len()];
        let mut root = vec3(&self.node(0)["translation"]);
        for channel in animation["channels"].as_array().unwrap() {
            let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
            let values = self.numbers(&sampler["output"]);
            let times = self.numbers(&sampler["input"]);
            assert_eq!(times.len(), values.len());
            let at = frame.min(values.len() - 1);
            let value = &values[at];
            assert!((times[at][0] - FPS.secs(at)).abs() < 1e-6);
            match channel["target"]["path"].as_str().unwrap() {
                "translation" => root = [value[0], value[1], value[2]],
                "rotation" => {
                    let node = channel["target"]["node"].as_u64().unwrap() as usize;
                    local[node] = Rotation { w: value[3], v: [value[0], value[1], value[2]] };
                }
                other => panic!("{other}"),
            }
        }
        (local, root)
    }

    /// Places of all vertices in a frame by linear skinning.
    pub fn skinned(&self, frame: usize) -> Vec<Vec3> {
        let (local, root) = self.pose(frame);
        let world = self.world(&local, root);
        let binds = self.numbers(&self.scene["skins"][0]["inverseBindMatrices"]);
        let mut places = Vec::new();
        for part in self.scene["meshes"][0]["primitives"].as_array().unwrap() {
            let of = |name: &str| self.numbers(&part["attributes"][name]);
            let (points, joints, weights) = (of("POSITION"), of("JOINTS_0"), of("WEIGHTS_0"));
            for (n, point) in points.iter().enumerate() {
                let carried = joints[n].iter().zip(&weights[n]).map(|(&joint, &weight)| {
                    let (turn, place) = world[joint as usize];
                    let bound: Vec3 = std::array::from_fn(|k| point[k] + binds[joint as usize][12 + k]);
                    scale(add(turn.turn(bound), place), weight / 65_535.0)
                });
                places.push(carried.fold([0.0; 3], add));
            }
        }
        places
    }
}

fn vec3(value: &Value) -> Vec3 {
    std::array::from_fn(|k| value[k].as_f64().unwrap())
}

/// A made-up motion performed and written under `names`.
pub fn written(folder: &Path, n_frames: usize, names: Names) -> (Performance, PathBuf) {
    let performance = perform(&swinging(3, n_frames), None, &AnimationOptions::default());
    let path = folder.join(format!("{}.glb", names.label()));
    ExportFormat::Glb
        .write(&path, &performance, &ExportContent { names, ..ExportContent::default() }, &Silent)
        .unwrap();
    (performance, path)
}

#[test]
fn nodes_and_animation_give_the_joints_of_the_performance() {
    let folder = tempfile::tempdir().unwrap();
    let (performance, path) = written(folder.path(), 40, Names::Own);
    let glb = Glb::read(&path);
    let expected = performance.motion();
    let mut worst: f64 = 0.0;
    for frame in 0..expected.n_frames() {
        let (local, root) = glb.pose(frame);
        let world = glb.world(&local, root);
        let neck = world[performance.figure.places[0]].1;
        for (joint, &node) in performance.figure.places.iter().enumerate() {
            let [x, y, z] = sub(world[node].1, neck);
            let place = [x, -y, -z];
            let apart = (0..3).map(|k| (place[k] - f64::from(expected.joints[[frame, joint, k]])).powi(2)).sum::<f64>();
            worst = worst.max(1e3 * apart.sqrt());
        }
    }
    eprintln!("forward kinematics of the GLB: {worst:.5} mm");
    assert!(worst < 0.1, "{worst} mm");
    let rest = glb.world(&vec![Rotation::IDENTITY; performance.figure.skeleton.joints.len() + 1], [0.0; 3]);
    let hand = performance.figure.arms[0].hand;
    assert!(rest[hand].1[0] > 0.4 && rest[hand].1[2].abs() < 0.05, "left is at +x in the T-pose");
}

#[test]
fn the_skin_at_rest_is_the_mesh_and_every_vertex_hangs_on_its_joints() {
    let folder = tempfile::tempdir().unwrap();
    let (performance, path) = written(folder.path(), 3, Names::Own);
    let glb = Glb::read(&path);
    let n_joints = performance.figure.skeleton.joints.len();
    let inverse_binds = glb.numbers(&glb.scene["skins"][0]["inverseBindMatrices"]);
    assert_eq!(inverse_binds.len(), n_joints);
    let root = vec3(&glb.node(0)["translation"]);
    let rest = glb.world(&vec![Rotation::IDENTITY; n_joints + 1], root);
    let (mut n_triangles, mut low, mut high) = (0, [f64::MAX; 3], [f64::MIN; 3]);
    let mut carried = vec![0.0; n_joints];
    for part in glb.scene["meshes"][0]["primitives"].as_array().unwrap() {
        let of = |name: &str| glb.numbers(&part["attributes"][name]);
        let (points, normals, joints, weights) = (of("POSITION"), of("NORMAL"), of("JOINTS_0"), of("WEIGHTS_0"));
        for (n, point) in points.iter().enumerate() {
            assert_eq!(weights[n].iter().sum::<f64>(), 65_535.0);
            let length = normals[n].iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 1e-5);
            let point: Vec3 = std::array::from_fn(|k| point[k]);
            let mut skinned = [0.0; 3];
            for (&joint, &weight) in joints[n].iter().zip(&weights[n]) {
                let joint = joint as usize;
                let bind: Vec3 = std::array::from_fn(|k| inverse_binds[joint][12 + k]);
                skinned = add(skinned, scale(add(add(point, bind), rest[joint].1), weight / 65_535.0));
                carried[joint] += weight / 65_535.0;
            }
            assert!(norm(sub(skinned, point)) < 1e-5);
            (0..3).for_each(|k| (low[k], high[k]) = (low[k].min(point[k]), high[k].max(point[k])));
        }
        let corners = glb.numbers(&part["indices"]);
        assert!(corners.iter().all(|corner| (corner[0] as usize) < points.len()));
        n_triangles += corners.len() / 3;
    }
    eprintln!("{n_triangles} triangles, {} bytes", std::fs::metadata(&path).unwrap().len());
    assert!((10_000..60_000).contains(&n_triangles) && std::fs::metadata(&path).unwrap().len() < 2_000_000);
    // The soles on the floor, the head above, as wide as the arms are long, facing +z with its feet.
    assert!(low[1].abs() < 0.02 && (1.2..2.4).contains(&high[1]) && (low[0] + high[0]).abs() < 0.05);
    assert!(high[2] > -low[2]);
    for (joint, bone) in performance.figure.skeleton.joints.iter().enumerate() {
        assert!(bone.end || carried[joint] > 5.0, "{} carries {} vertices", bone.name, carried[joint]);
    }
}

#[test]
fn a_joint_at_rest_has_one_key_and_no_frame_no_animation() {
    let folder = tempfile::tempdir().unwrap();
    let (performance, path) = written(folder.path(), 20, Names::Own);
    let glb = Glb::read(&path);
    let keys = |node: usize| {
        let animation = &glb.scene["animations"][0];
        let channel = animation["channels"]
            .as_array()
            .unwrap()
            .iter()
            .find(|channel| channel["target"]["node"] == node && channel["target"]["path"] == "rotation");
        glb.numbers(&animation["samplers"][channel.unwrap()["sampler"].as_u64().unwrap() as usize]["output"]).len()
    };
    let leg = performance.figure.skeleton.find("LeftLeg").unwrap();
    assert_eq!((keys(leg), keys(performance.figure.arms[0].fore)), (1, 20));
    let (_, path) = written(folder.path(), 0, Names::Own);
    assert!(Glb::read(&path).scene.get("animations").is_none());
}

/// The validator's module: ORATOR_GLTF_VALIDATOR, or `target/validator/gltf-validator`.
fn validator() -> Option<PathBuf> {
    let named = std::env::var_os("ORATOR_GLTF_VALIDATOR").map(PathBuf::from);
    let module = named.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("target/validator"));
    let there = module.join("package.json").is_file() && Command::new("node").arg("--version").output().is_ok();
    if !there {
        eprintln!("SKIPPED: no node, or no glTF validator at {} (make validator)", module.display());
    }
    there.then_some(module)
}

const VALIDATE: &str = "
const validator = require(process.argv[1]), fs = require('fs');
const all = process.argv.slice(2).map(file => validator.validateBytes(new Uint8Array(fs.readFileSync(file))));
Promise.all(all).then(reports => console.log(JSON.stringify(reports.map(report => report.issues))));
";

#[test]
fn the_khronos_validator_finds_nothing() {
    let Some(module) = validator() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut files: Vec<PathBuf> = Names::ALL.map(|names| written(folder.path(), 12, names).1).to_vec();
    // One frame; a speaker of whom nothing is seen.
    let one = perform(&swinging(5, 1), None, &AnimationOptions::default());
    let mut unseen = swinging(5, 4);
    unseen.joints.fill(f32::NAN);
    let unseen = perform(&unseen, None, &AnimationOptions::default());
    for (name, performance) in [("one.glb", &one), ("unseen.glb", &unseen)] {
        files.push(folder.path().join(name));
        ExportFormat::Glb.write(&files[files.len() - 1], performance, &ExportContent::default(), &Silent).unwrap();
    }
    let output = Command::new("node").args(["-e", VALIDATE]).arg(&module).args(&files).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let reports: Value = serde_json::from_slice(&output.stdout).unwrap();
    for (file, issues) in files.iter().zip(reports.as_array().unwrap()) {
        eprintln!("{}: {issues}", file.file_name().unwrap().display());
        assert_eq!((&issues["numErrors"], &issues["numWarnings"]), (&Value::from(0), &Value::from(0)), "{issues}");
        let known = |message: &Value| message["code"] == "UNSUPPORTED_EXTENSION" && file.ends_with("vrm.glb");
        assert!(issues["messages"].as_array().unwrap().iter().all(known), "{issues}");
    }
}
