//! Tests of `orator_formats::bvh::read`.

use orator_formats::bvh::read::{Bvh, MAX_DEPTH, MAX_JOINTS};

#[test]
fn oversized_skeletons_are_rejected() {
    let error_of = |text: String| format!("{:#}", Bvh::parse(&text).unwrap_err());
    let head = "HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Xposition ";
    let joint = "JOINT b { OFFSET 0 0 0 } ";
    assert!(error_of(format!("{head}{}", joint.repeat(MAX_JOINTS))).contains("more than 10000 joints"));
    assert!(error_of(format!("{head}{}", "JOINT b { ".repeat(MAX_DEPTH))).contains("nested deeper than 512 levels"));
    // Each nested end site would extend the name of its parent.
    assert!(error_of(format!("{head}{}", "End Site { ".repeat(300))).contains("the name has"));
    let valid = format!("{head}{}}} MOTION Frames: 1 Frame Time: 0.04 0", joint.repeat(MAX_JOINTS - 1));
    assert_eq!(Bvh::parse(&valid).unwrap().joints.len(), MAX_JOINTS);
}
