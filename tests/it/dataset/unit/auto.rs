//! Unit tests of `orator_dataset::config::auto`.

use orator_dataset::config::auto::Auto;
use serde_json::json;

#[test]
fn auto_and_numbers_are_parsed() {
    let read = |value| serde_json::from_value::<Auto<usize>>(value).map_err(|error| error.to_string());
    assert_eq!(read(json!("auto")), Ok(Auto::Chosen));
    assert_eq!(read(json!(7)), Ok(Auto::Given(7)));
    for wrong in [json!("seven"), json!(-1), json!(1.5)] {
        assert!(read(wrong).unwrap_err().contains("expected \"auto\" or a number"));
    }
    assert_eq!(serde_json::from_value::<Auto<f64>>(json!(7)).unwrap(), Auto::Given(7.0));
    assert_eq!(serde_json::to_value([Auto::Chosen, Auto::Given(0.5)]).unwrap(), json!(["auto", 0.5]));
    assert_eq!((Auto::<usize>::Chosen.given(), Auto::Given(4).given()), (None, Some(4)));
}
