//! Unit tests of `orator_gesture::evaluate::conclusion::labels`.

use orator_base::math::estimate::Estimate;
use orator_gesture::evaluate::conclusion::labels::{bracketed, name, number, unit};
use orator_gesture::metrics::catalogue::Catalogue;
use orator_gesture::metrics::settings::MetricSettings;
use std::collections::BTreeSet;

#[test]
fn every_metric_has_a_unique_readable_name() {
    let catalogue = Catalogue::new(&MetricSettings::default()).unwrap();
    let names: Vec<String> = catalogue.definitions().iter().map(name).collect();
    assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len(), "{names:#?}");
    assert!(names.iter().all(|name| !name.contains('_')), "{names:#?}");
    assert_eq!(names[0], "correct keypoints at 0.2");
}

#[test]
fn numbers_are_short() {
    let catalogue = Catalogue::new(&MetricSettings::default()).unwrap();
    let share = &catalogue.definitions()[0];
    let estimate = Estimate::new(0.4123, 0.38, 0.44);
    assert_eq!(bracketed(share, &estimate), "41.2 [38.0, 44.0]");
    let error = catalogue.definitions().iter().find(|d| d.name == "mpjpe").unwrap();
    assert_eq!(unit(error), "mm");
    let shown = [1234.56, 233.04, 12.345, 0.12345, 0.012345, 0.0, f64::NAN].map(|v| number(error, v));
    assert_eq!(shown, ["1235", "233.0", "12.3", "0.123", "0.0123", "0", "-"]);
}
