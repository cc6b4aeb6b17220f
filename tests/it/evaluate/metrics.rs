//! The metrics on the authors' released clips: the published share of correct keypoints in the image plane.

use orator_base::types::time::FrameRate;
use orator_formats::authors_txt;
use orator_gesture::metrics::position::pck::{CorrectKeypoints, PckAxes};
use orator_test_support::skip::real_data;

#[test]
fn released_predictions_have_the_published_pck() {
    for (number, expected) in [(1845, 0.3690), (3821, 0.2553), (3838, 0.1136), (102_571, 0.7294)] {
        let clip = |name: &str| {
            let path = real_data(&format!("data/released_clips/{name}_interval_{number}.txt"))?;
            Some(authors_txt::read(&path, FrameRate::new(15, 1)).unwrap())
        };
        let (Some(real), Some(predicted)) = (clip("gt"), clip("prediction")) else { return };
        let mut correct = CorrectKeypoints::default();
        correct.count(PckAxes::Xy, predicted.joints.view(), real.joints.view(), real.mask.view());
        assert!((correct.share() - expected).abs() < 1e-4, "{number}: {}", correct.share());
    }
}
