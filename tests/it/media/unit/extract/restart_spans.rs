//! Tests of `orator_pipeline::extract::spans`.

use orator_base::types::time::FrameRate;
use orator_pipeline::extract::spans::{candidates, count};

#[test]
fn spans_begin_at_marks_or_following_cuts_and_the_last_is_not_short() {
    let rate = FrameRate::new(10, 1);
    let mut restarts = vec![false; 4199];
    assert_eq!(candidates(&restarts, rate), [1200, 2400]);
    restarts.push(false);
    assert_eq!(candidates(&restarts, rate), [1200, 2400, 3600]);
    for cut in [0, 1100, 1399, 2600, 3600] {
        restarts[cut] = true;
    }
    assert_eq!(candidates(&restarts, rate), [1399, 2400, 3600]);
    assert_eq!(candidates(&restarts[..1799], rate), [0; 0]);
    assert_eq!([179.9, 180.0, 300.0, 1020.0].map(count), [1, 2, 3, 9]);
}
