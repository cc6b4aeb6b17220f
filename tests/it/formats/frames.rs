//! Frames of foreign keypoint files.

use orator_formats::keypoints::found::FoundPerson;
use orator_formats::keypoints::frames::{in_order, number_of};

#[test]
fn frame_number_is_the_last_run_of_digits() {
    for (name, number) in [
        ("talk2_000000000012_keypoints.json", Some(12)),
        ("0.jpg", Some(0)),
        ("frame7.png", Some(7)),
        ("7", Some(7)),
        ("a.json", None),
        ("20240101123456789012345_5.json", Some(5)),
        ("99999999999999999999999", Some(999_999_999_999_999_999)),
        ("é1é.json", Some(1)),
    ] {
        assert_eq!(number_of(name), number, "{name}");
    }
}

#[test]
fn gaps_become_empty_frames_with_a_note() {
    let frames = |numbers: &[u64]| in_order(numbers.iter().map(|n| (*n, vec![FoundPerson::default()])).collect());
    let (found, notes) = frames(&[1, 2, 3]).unwrap();
    assert_eq!((found.len(), notes.len()), (3, 0));
    let (found, notes) = frames(&[2, 5]).unwrap();
    assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [0, 1, 0, 0, 1]);
    assert_eq!(
        notes,
        [
            "the first frame has number 2: 1 frame before it marked as not detected",
            "2 missing frames (the first is number 3): marked as not detected"
        ]
    );
    assert!(frames(&[]).is_err());
    let text = frames(&[3, u64::MAX]).unwrap_err().to_string();
    assert!(text.contains("2 frames numbered from 3 to"), "{text}");
}
