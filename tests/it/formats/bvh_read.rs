//! BVH files of any program: order of channels, positions, encodings, errors.

use orator_base::math::vec3::Vec3;
use orator_formats::bvh::read::{Bvh, Positions};

/// A root and an arm of two bones of length 10 along x; `elbow_channels` is the CHANNELS line of the elbow.
fn arm(elbow_channels: &str, motion: &str) -> String {
    format!(
        "HIERARCHY\nROOT Hips\n{{\nOFFSET 0 5 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n\
         JOINT Elbow\n{{\nOFFSET 10 0 0\nCHANNELS {elbow_channels}\nEnd Site\n{{\nOFFSET 10 0 0\n}}\n}}\n}}\n\
         MOTION\nFrames: 1\nFrame Time: 0.04\n{motion}\n"
    )
}

fn assert_close(a: Vec3, b: Vec3) {
    assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-9), "{a:?} {b:?}");
}

#[test]
fn rotations_apply_in_channel_order() {
    // The root is at (1, 5 + 2, 3), rotated 90 about z; the elbow 90 about y, then, in its own axes, 90 about x.
    let bvh = Bvh::parse(&arm("3 Yrotation Xrotation Zrotation", "1 2 3 90 0 0 90 90 90")).unwrap();
    assert_eq!((bvh.n_frames, bvh.frame_secs, bvh.joints[2].name.as_str()), (1, 0.04, "Elbow_end"));
    let pose = &bvh.positions(Positions::Auto)[0];
    assert_close(pose[0], [1.0, 7.0, 3.0]);
    assert_close(pose[1], [1.0, 17.0, 3.0]);
    // Ry(90) Rx(90) Rz(90) x = Ry(90) Rx(90) y = Ry(90) z = x, and the root rotates x to y.
    assert_close(pose[2], [1.0, 27.0, 3.0]);
    let other = Bvh::parse(&arm("3 Zrotation Yrotation Xrotation", "0 0 0 0 0 0 0 90 0")).unwrap();
    assert_close(other.positions(Positions::Auto)[0][2], [10.0, 5.0, -10.0]);
}

#[test]
fn position_channels_replace_or_add() {
    let channels = "6 Xposition Yposition Zposition Zrotation Yrotation Xrotation";
    let text = arm(channels, "0 0 0 0 0 0 10.2 0 0 0 0 0");
    let bvh = Bvh::parse(&text).unwrap();
    assert_eq!(bvh.resolve(Positions::Auto), Positions::Replace);
    assert_close(bvh.positions(Positions::Auto)[0][1], [10.2, 0.0, 0.0]);
    assert_close(bvh.positions(Positions::Add)[0][1], [20.2, 5.0, 0.0]);
    let small = Bvh::parse(&arm(channels, "0 0 0 0 0 0 0.1 0 0 0 0 0")).unwrap();
    assert_eq!(small.resolve(Positions::Auto), Positions::Add);
    assert_close(small.positions(Positions::Auto)[0][1], [10.1, 5.0, 0.0]);
}

#[test]
fn errors_name_the_position_in_the_file() {
    let good = arm("3 Zrotation Yrotation Xrotation", "0 0 0 0 0 0 0 0 0");
    for (broken, expected) in [
        (String::new(), "unexpected end of file"),
        (good.replace("ROOT", "LEAF"), "line 2: found `LEAF`"),
        (good.replace("Yrotation", "Wrotation"), "line 5: unknown channel `Wrotation`"),
        (good.replace("Frames: 1", "Frames: 3"), "line 19: the file has 1 frame, line 17 states 3"),
        (good.replace("Frames: 1", "Frames: -1"), "line 17: invalid number of frames -1"),
        (good.replace("0.04", "0"), "line 18: invalid frame time 0"),
        (good.replace("0.04", "1e-300"), "invalid frame time 1"),
        (good.replace("0.04", "1.1"), "expected 0.001 to 1"),
        (good.replace("MOTION", "}"), "MOTION"),
        (good.replace("OFFSET 10 0 0", "OFFSET ten 0 0"), "line 8: found `ten`"),
        (good[..20].to_owned(), "line 2: unexpected end"),
        (format!("# made by hand\n\n{}", good.replace("MOTION", "ACTION")), "line 18: found `ACTION`"),
    ] {
        let text = format!("{:#}", Bvh::parse(&broken).unwrap_err());
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn names_and_comments_in_other_encodings_are_read() {
    let text = arm("3 Zrotation Yrotation Xrotation", "0 0 0 0 0 0 0 0 0");
    let marked = Bvh::from_bytes(format!("\u{feff}{text}").as_bytes()).unwrap();
    assert_eq!((marked.joints.len(), marked.notes.len()), (3, 0));
    // Shift-JIS: a katakana name with the byte of a brace, and one that differs in a control character of Latin-1.
    let named = |name: &[u8]| {
        let (before, after) = text.split_once("Elbow").unwrap();
        let bytes = [b"// so\xf6\r\n".as_slice(), before.as_bytes(), name, after.as_bytes()].concat();
        Bvh::from_bytes(&bytes).unwrap()
    };
    let (first, second) = (named(b"\x83{\x85\xa0"), named(b"\x83{\x84\xa0"));
    assert!(first.joints[1].name != second.joints[1].name && !first.joints[1].name.contains(char::is_whitespace));
    assert_eq!(named(b"\xc9paule").joints[2].name, "Épaule_end");
    assert_eq!(first.notes, ["the text is not UTF-8: joint names are read as Latin-1"]);
    orator_formats::bvh::skeleton::BvhSkeleton::of(&first).check().unwrap();
}

#[test]
fn implausible_counts_allocate_no_memory() {
    let joints = "JOINT a { OFFSET 0 0 0 ".repeat(200) + &"} ".repeat(200);
    let file = |channels: &str, n_frames: usize, values: &str| {
        format!(
            "HIERARCHY ROOT a {{ OFFSET 0 0 0 CHANNELS {channels} {joints} }} MOTION Frames: {n_frames} \
             Frame Time: 0.04 {values}"
        )
    };
    let error_of = |text: &str| format!("{:#}", Bvh::parse(text).unwrap_err());
    assert!(error_of(&file("0", 99_999_999, "")).contains("99999999 frames without channels"));
    let many = error_of(&file("1 Xposition", 20_000, &"0 ".repeat(20_000)));
    assert!(many.contains("20000 frames of 201 joints with only 1 channel:"), "{many}");
    assert_eq!(Bvh::parse(&file("1 Xposition", 100, &"0 ".repeat(100))).unwrap().n_frames, 100);
}
