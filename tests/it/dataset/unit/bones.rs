//! Tests of `orator_dataset::bones`.

use orator_base::types::skeleton::N_BONES;
use orator_dataset::bones::{VideoBones, check_lengths, of_speaker};

#[test]
fn impossible_lengths_are_rejected_and_the_field_is_named() {
    let check = |lengths: &[f64]| check_lengths("lengths_metres", lengths).map_err(|error| error.to_string());
    assert_eq!(check(&[0.0; N_BONES]), Ok(()));
    for invalid in [-0.1, f64::NAN, f64::INFINITY, 10.0] {
        let mut lengths = [0.2; N_BONES];
        lengths[7] = invalid;
        assert!(check(&lengths).unwrap_err().starts_with(&format!("`lengths_metres` has the length {invalid:?}")));
    }
    assert!(check(&[0.2]).unwrap_err().contains("has 1 lengths"));
}

#[test]
fn long_videos_weigh_more_and_unmeasured_bones_have_no_weight() {
    let video = |length: f64, n_frames| {
        let mut lengths_metres = vec![length; N_BONES];
        lengths_metres[6] = 0.0;
        VideoBones { lengths_metres, n_frames }
    };
    let lengths = of_speaker(&[video(0.3, 100), video(0.2, 40), video(0.9, 50), video(0.0, 1000)]);
    assert_eq!((lengths[0], lengths[6]), (0.3, 0.0));
    assert_eq!(of_speaker(&[video(0.3, 0)])[0], 0.0);
}
