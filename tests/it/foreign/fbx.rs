//! FBX files read by the library ufbx have the expected joints, frame rate, skin and bind pose.

use crate::fixtures::animation::truth::worst_joint_mm;
use crate::fixtures::figures::swinging;
use orator_avatar::animate::export::file::{ExportContent, ExportFormat};
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::{AnimationOptions, Performance, perform};
use orator_base::stage::progress::Silent;
use orator_base::types::time::FrameRate;

fn fbx_bytes(performance: &Performance, names: Names) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.fbx");
    let content = ExportContent { names, ..ExportContent::default() };
    ExportFormat::Fbx.write(&path, performance, &content, &Silent).unwrap();
    std::fs::read(path).unwrap()
}

fn load(bytes: &[u8]) -> ufbx::SceneRoot {
    ufbx::load_memory(bytes, ufbx::LoadOpts { strict: true, ..Default::default() }).expect("ufbx reads the file")
}

#[test]
fn ufbx_reads_the_joints_of_the_motion() {
    for (names, fps) in Names::ALL.into_iter().zip([(15, 1), (24, 1), (60, 1), (30000, 1001), (7, 1)]) {
        let fps = FrameRate::new(fps.0, fps.1);
        let performance = perform(&swinging(3, 20), None, &AnimationOptions { fps: Some(fps), ..Default::default() });
        let bytes = fbx_bytes(&performance, names);
        assert_eq!(bytes, fbx_bytes(&performance, names), "the output is deterministic");
        let scene = load(&bytes);
        assert_eq!((scene.metadata.warnings.len(), scene.metadata.version), (0, 7400));
        assert_eq!((scene.anim_stacks.len(), scene.settings.unit_meters), (1, 0.01));
        assert!(
            (scene.settings.frames_per_second - fps.per_sec()).abs() < 1e-3,
            "{}",
            scene.settings.frames_per_second
        );
        let frames: Vec<_> = (0..performance.clip.n_frames())
            .map(|t| ufbx::evaluate_scene(&scene, &scene.anim, fps.secs(t), ufbx::EvaluateOpts::default()).unwrap())
            .collect();
        let worst = worst_joint_mm(&performance, names, |frame, name| {
            let world = ufbx::find_node(&frames[frame], name).unwrap().node_to_world;
            [world.m03, world.m13, world.m23]
        });
        eprintln!("FBX {}: ufbx's joints lie within {worst:.5} mm of the motion's", names.label());
        assert!(worst < 0.1, "{worst} mm");
    }
}

#[test]
fn the_skin_follows_the_joints_and_its_bind_pose_is_the_rest_pose() {
    let performance = perform(&swinging(3, 4), None, &AnimationOptions::default());
    let scene = load(&fbx_bytes(&performance, Names::Mixamo));
    assert!(scene.meshes.len() >= 5 && scene.skin_deformers.len() == scene.meshes.len());
    for skin in &scene.skin_deformers {
        assert!(!skin.clusters.is_empty());
        for vertex in &skin.vertices {
            let weights = (0..vertex.num_weights).map(|n| skin.weights[(vertex.weight_begin + n) as usize].weight);
            assert!((weights.sum::<f64>() - 1.0).abs() < 1e-6);
        }
        for cluster in &skin.clusters {
            // The rest transform of the joint equals its bind transform.
            let (node, bind) = (&cluster.bone_node.as_ref().unwrap().node_to_world, &cluster.bind_to_world);
            for (a, b) in [(node.m03, bind.m03), (node.m13, bind.m13), (node.m00, bind.m00), (node.m12, bind.m12)] {
                assert!((a - b).abs() < 1e-6, "{a} {b}");
            }
        }
    }
    let empty = perform(&swinging(3, 0), None, &AnimationOptions::default());
    assert_eq!(load(&fbx_bytes(&empty, Names::Own)).anim_stacks.len(), 0);
}
