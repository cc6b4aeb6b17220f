//! Clock for all times that the server stores and compares. Corrections of the wall clock, even across a restart,
//! neither block participants nor end their sessions.

use std::time::{Instant, SystemTime};

/// Clock that reads the wall clock once at the start and is monotonic afterwards.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start_ms: i64,
    started: Instant,
}

impl Clock {
    /// Starts at the wall clock's time or at `latest_ms` (the latest stored time, milliseconds since 1970), whichever
    /// is later.
    pub fn start(latest_ms: i64) -> Self {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let wall_ms = since.map_or(0, |since| since.as_millis() as i64);
        Self { start_ms: wall_ms.max(latest_ms), started: Instant::now() }
    }

    /// Milliseconds since 1970.
    pub fn now_ms(&self) -> i64 {
        self.start_ms.saturating_add(self.started.elapsed().as_millis() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
}
