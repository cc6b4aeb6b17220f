//! Tests of `orator_formats::bvh::frame_time`.

use orator_base::types::time::FrameRate;
use orator_formats::bvh::frame_time::{rate, rounded_rate};

#[test]
fn rounded_frame_times_are_those_of_the_common_rates() {
    for (written, num, den) in [
        ("0.017", 60, 1),
        ("0.033", 30, 1),
        ("0.0330000", 30, 1),
        ("0.008", 120, 1),
        ("0.042", 24, 1),
        ("0.067", 15, 1),
        ("0.0167", 60, 1),
        ("0.0333", 30, 1),
        ("0.0083", 120, 1),
        ("0.0334", 30_000, 1001),
        ("0.01668", 60_000, 1001),
        ("0.00834", 120_000, 1001),
    ] {
        let rate = rounded_rate(written, written.parse().unwrap());
        assert_eq!(rate, Some(FrameRate::new(num, den)), "{written}");
    }
    for written in ["0.04", "0.02", "0.01", "0.1", "0.0125", "0.025", "0.005", "0.016", "0.033333", "0.008342", "1"] {
        assert_eq!(rounded_rate(written, written.parse().unwrap()), None, "{written}");
    }
}

#[test]
fn exact_frame_times_keep_their_rates() {
    for (frame_secs, num, den) in [
        (0.008_341_67, 120_000, 1001),
        (0.008_333_33, 120, 1),
        (0.033_366_7, 30_000, 1001),
        (0.041_708_4, 24_000, 1001),
        (0.04, 25, 1),
        (0.1, 10, 1),
        (0.005, 200, 1),
    ] {
        assert_eq!(rate(frame_secs), FrameRate::new(num, den), "{frame_secs}");
    }
}
