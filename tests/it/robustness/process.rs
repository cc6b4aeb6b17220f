//! Messages to and from the processes of units.

use crate::dataset::decisions::decision;
use orator_dataset::config::{KeypointSource, Settings};
use orator_dataset::decisions::DecisionAction;
use orator_pipeline::process::message::{Message, Request, UnitRequest, receive, send};
use serde_json::json;
use std::ffi::OsString;

#[test]
fn numbers_round_trip_exactly_and_names_byte_for_byte() {
    let facts = json!({ "a": 0.1 + 0.2, "b": 1.0, "c": 3, "d": null, "e": [-1, 1e300, 0.017_453_292_519_943_295] });
    let facts = facts.as_object().unwrap().clone();
    let settings = Settings::default();
    let source = {
        use std::os::unix::ffi::OsStringExt as _;
        OsString::from_vec(vec![b'a', 0xff])
    };
    let unit = UnitRequest {
        stage: "extract".into(),
        speaker: "host".into(),
        video: "a".into(),
        source: source.clone(),
        part: Some(3),
        settings: settings.clone(),
        config_file: "pipeline.toml".into(),
        keypoints: Some(KeypointSource { fps: None, image_size: Some([4, 3]), sound: Err("none".into()) }),
        decisions: vec![decision("b", DecisionAction::SwapHands, (1.0, 2.0))],
        reads: vec![source.clone()],
        out: "out".into(),
        memory: 1 << 40,
    };
    let mut pipe = Vec::new();
    send(&mut pipe, &Request::Unit(Box::new(unit))).unwrap();
    send(&mut pipe, &Message::Done { line: "l".into(), facts: facts.clone() }).unwrap();
    let mut pipe = pipe.as_slice();
    let Request::Unit(unit) = receive(&mut pipe).unwrap() else { panic!("another request") };
    assert_eq!(unit.decisions, [decision("b", DecisionAction::SwapHands, (1.0, 2.0))]);
    assert_eq!((unit.settings, unit.source), (settings, source));
    let Message::Done { facts: back, .. } = receive(&mut pipe).unwrap() else { panic!("another message") };
    assert_eq!(serde_json::to_string(&back).unwrap(), serde_json::to_string(&facts).unwrap());
    assert!(receive::<Message>(&mut pipe).is_err());
}
