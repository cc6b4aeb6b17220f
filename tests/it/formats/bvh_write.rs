//! BVH files written and read back.

use orator_base::math::rotation::Rotation;
use orator_base::motion::fk::Skeleton;
use orator_base::types::time::FrameRate;
use orator_formats::bvh::write::BvhClip;

fn clip() -> BvhClip {
    let mut skeleton = Skeleton::default();
    let hips = skeleton.push("Hips", None, [0.0; 3], false);
    let left = skeleton.push("Left", Some(hips), [1.0, 0.0, 0.0], false);
    let right = skeleton.push("Right", Some(hips), [-1.0, 0.0, 0.0], false);
    skeleton.push("", Some(left), [1.0, 0.0, 0.0], true);
    skeleton.push("", Some(right), [-1.0, 0.0, 0.0], true);
    let turn = |degrees: f64| {
        let r = Rotation::about([0.0, 0.0, 1.0], degrees.to_radians());
        vec![Rotation::IDENTITY, r, Rotation::IDENTITY, Rotation::IDENTITY, Rotation::IDENTITY]
    };
    let local = vec![turn(0.0), turn(30.0)];
    BvhClip { skeleton, fps: FrameRate::new(15, 1), root: [0.0, 90.0, 0.0], travel: Vec::new(), local }
}

#[test]
fn text_is_valid_bvh() {
    let expected = "HIERARCHY\nROOT Hips\n{\n\tOFFSET 0.000000 0.000000 0.000000\n\tCHANNELS 6 Xposition Yposition \
        Zposition Zrotation Xrotation Yrotation\n\tJOINT Left\n\t{\n\t\tOFFSET 1.000000 0.000000 0.000000\n\t\t\
        CHANNELS 3 Zrotation Xrotation Yrotation\n\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 1.000000 0.000000 0.000000\n\
        \t\t}\n\t}\n\tJOINT Right\n";
    let text = clip().to_bvh().replace("-0.00000 ", "0.00000 ").replace("-0.00000\n", "0.00000\n");
    assert!(text.starts_with(expected), "{text}");
    let zero = "0.00000 0.00000 0.00000";
    let end = format!(
        "}}\nMOTION\nFrames: 2\nFrame Time: 0.06666667\n0.000000 90.000000 0.000000 {zero} {zero} {zero}\n\
         0.000000 90.000000 0.000000 {zero} 30.00000 0.00000 0.00000 {zero}\n"
    );
    assert!(text.ends_with(&end), "{text}");
    assert_eq!(text.matches('{').count(), text.matches('}').count());
}

#[test]
fn resampling_keeps_duration_and_passes_through_frames() {
    let mut given = clip();
    let turns = [0.0, 30.0, 60.0, 90.0]
        .map(|degrees: f64| vec![Rotation::about([0.0, 0.0, 1.0], degrees.to_radians()); given.skeleton.joints.len()]);
    given.local = turns.to_vec();
    let twice = given.resampled(FrameRate::new(30, 1));
    let degrees: Vec<f64> = twice.local.iter().map(|frame| frame[1].angle().to_degrees()).collect();
    assert_eq!(degrees.len(), 8);
    for (n, expected) in [(0, 0.0), (2, 30.0), (3, 45.0), (4, 60.0), (6, 90.0), (7, 90.0)] {
        assert!((degrees[n] - expected).abs() < 1e-9, "{degrees:?}");
    }
    assert!(degrees[1] > 8.0 && degrees[1] < 15.0 && degrees[5] > 75.0, "{degrees:?}");
    given.local.clear();
    assert_eq!(given.resampled(FrameRate::new(30, 1)).n_frames(), 0);
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config::with_cases(48))]
    #[test]
    fn written_clip_round_trips(
        turns in proptest::collection::vec(([-1.0f64..1.0, -1.0f64..1.0, -1.0f64..1.0], -3.1f64..3.1), 6),
        offsets in [-50.0f64..50.0, -50.0f64..50.0, -50.0f64..50.0],
    ) {
        let mut skeleton = Skeleton::default();
        let hips = skeleton.push("Hips", None, [0.0; 3], false);
        let spine = skeleton.push("Spine", Some(hips), offsets, false);
        skeleton.push("", Some(spine), [0.0, 10.0, 1.0], true);
        let turn = |(axis, angle): ([f64; 3], f64)| {
            let axis = orator_base::math::vec3::unit(axis, 1e-3).unwrap_or([0.0, 1.0, 0.0]);
            Rotation::about(axis, angle)
        };
        let local = turns.chunks(2).map(|t| vec![turn(t[0]), turn(t[1]), Rotation::IDENTITY]).collect();
        let clip = BvhClip { skeleton, fps: FrameRate::new(30, 1), root: [1.0, 90.0, -2.0], travel: Vec::new(), local };
        let read = orator_formats::bvh::read::Bvh::parse(&clip.to_bvh()).unwrap();
        proptest::prop_assert_eq!(read.n_frames, clip.n_frames());
        let positions = read.positions(orator_formats::bvh::read::Positions::Replace);
        for (frame, found) in positions.iter().enumerate() {
            for (a, b) in found.iter().zip(clip.positions(frame)) {
                proptest::prop_assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-4), "{a:?} {b:?}");
            }
        }
    }
}
