//! Unit tests of `orator_dataset::info`.

use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use orator_dataset::config::SplitUnit;
use orator_dataset::info::{About, DatasetInfo, DatasetVideo, keypoint_names};
use orator_dataset::sample::N_KEYPOINTS;
use orator_dataset::split::{Split, SplitBy, SplitRule};
use std::collections::BTreeMap;

/// The setting that is already active is not proposed.
#[test]
fn the_remedy_of_an_empty_split_fits_its_rule() {
    let about = About::new("anna", FrameRate::new(15, 1));
    let remedy = |unit, split_by| {
        let (name, file, content) = (String::new(), String::new(), String::new());
        let (split, blocks) = (Some(Split::Train), Vec::new());
        let video = DatasetVideo { name, file, content, split, split_by, blocks, samples: 1, secs: 9.0 };
        let mut info = DatasetInfo::new(&about, &[0.2; N_JOINTS - 1], BTreeMap::new(), vec![video]);
        info.split_rule = Some(SplitRule { unit, why: String::new(), guard_secs: 0.0 });
        info.empty_split_fix()
    };
    let by_time = "set `split_by = \"time\"`";
    assert!(remedy(SplitUnit::Video, SplitBy::Share).contains(by_time));
    let named = remedy(SplitUnit::Video, SplitBy::Name);
    assert!(named.contains(by_time) && named.contains("remove the splits named under [[speaker]]"), "{named}");
    assert!(remedy(SplitUnit::Time, SplitBy::Time).starts_with("too little footage was accepted to divide it"));
    assert!(remedy(SplitUnit::Time, SplitBy::Name).contains("named under [[speaker]] are not divided"));
}

#[test]
fn keypoint_names_are_unique() {
    let names = keypoint_names();
    assert_eq!(names.len(), N_KEYPOINTS);
    let different: std::collections::BTreeSet<_> = names.iter().collect();
    assert_eq!(different.len(), N_KEYPOINTS);
    assert_eq!((names[9].as_str(), names[17].as_str(), names[58].as_str()), ("LWrist", "LHandRoot", "RLittleTip"));
}
