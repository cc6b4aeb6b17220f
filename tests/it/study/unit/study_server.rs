//! Unit tests of `orator_study::server::study_server`.

use orator_study::server::study_server::Clock;
use std::time::Duration;

#[test]
fn time_continues_from_the_wall_clock_or_the_latest_stored_time() {
    let wall_ms = Clock::start(0).now_ms();
    assert!(wall_ms > 1_700_000_000_000, "{wall_ms}");
    let ahead_ms = wall_ms + 3_600_000;
    let clock = Clock::start(ahead_ms);
    std::thread::sleep(Duration::from_millis(20));
    let now_ms = clock.now_ms();
    assert!((ahead_ms + 20..ahead_ms + 60_000).contains(&now_ms), "{now_ms}");
    assert_eq!(Clock::start(i64::MAX).now_ms(), i64::MAX);
}
