//! Tests of `orator_avatar::animate::export::film`.

use orator_avatar::animate::export::film::smooth_rate;
use orator_base::types::time::FrameRate;

#[test]
fn the_default_rate_is_a_multiple_of_at_least_30_fps() {
    let rates = [(15, 1, 30, 1), (25, 1, 50, 1), (24, 1, 48, 1), (30_000, 1001, 30_000, 1001), (10, 1, 30, 1)];
    for (num, den, film_num, film_den) in rates {
        assert_eq!(smooth_rate(FrameRate::new(num, den)), FrameRate::new(film_num, film_den));
    }
    assert_eq!(smooth_rate(FrameRate::new(120, 1)), FrameRate::new(120, 1));
    let huge = FrameRate::new(u32::MAX, u32::MAX - 1);
    assert_eq!(smooth_rate(huge), huge);
}
