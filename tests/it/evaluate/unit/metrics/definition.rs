//! Tests of `orator_gesture::metrics::definition`.

use orator_base::types::skeleton::{L_WRIST, R_WRIST};
use orator_gesture::metrics::definition::{Better, BodyPart, Definition, MeasuredPoint};
use serde_json::json;

#[test]
fn the_hash_depends_on_everything_but_the_order_of_keys() {
    let definition = |parameters| Definition {
        formula: "share",
        undefined: "never",
        parameters,
        ..Definition::new("pck_3d", "all", "1", Better::Higher)
    };
    let one = definition(json!({"alpha": 0.2, "fps": [15, 1]}));
    assert_eq!(one.hash(), definition(json!({"fps": [15, 1], "alpha": 0.2})).hash());
    assert_ne!(one.hash(), definition(json!({"alpha": 0.1, "fps": [15, 1]})).hash());
    assert_ne!(one.hash(), Definition { part: "body", ..one.clone() }.hash());
    assert_ne!(one.hash(), Definition { formula: "part", ..one.clone() }.hash());
    assert_eq!((one.hash().len(), one.label()), (16, "pck_3d@0.2 all".into()));
}

#[test]
fn parts_have_their_documented_joints() {
    let n = |part: BodyPart| part.joints().len();
    assert_eq!(
        [BodyPart::All, BodyPart::WithNeck, BodyPart::Body, BodyPart::Hands, BodyPart::Wrists].map(n),
        [48, 49, 6, 40, 2]
    );
    let fingers = BodyPart::FingersFromWrist.points();
    assert!(fingers.contains(&MeasuredPoint { joint: 8, origin: Some(L_WRIST) }));
    assert!(fingers.contains(&MeasuredPoint { joint: 29, origin: Some(R_WRIST) }));
}
