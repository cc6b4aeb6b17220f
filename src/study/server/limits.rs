//! How often one may ask: a bucket of tokens for each participant, and one for all who begin.

use std::collections::HashMap;
use std::sync::Mutex;
use std::time::Instant;

/// How many requests come at once, and how many a second after that.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rate {
    at_once: f64,
    a_second: f64,
}

/// Of one participant, who needs about two a trial.
const PARTICIPANT: Rate = Rate { at_once: 100.0, a_second: 5.0 };
/// Of all who begin.
const BEGIN: Rate = Rate { at_once: 500.0, a_second: 10.0 };

#[derive(Clone, Copy, Debug)]
struct Bucket {
    left: f64,
    at: Instant,
}

impl Bucket {
    fn full(rate: Rate, at: Instant) -> Self {
        Self { left: rate.at_once, at }
    }

    /// Takes one token, if there is one.
    fn takes(&mut self, rate: Rate, now: Instant) -> bool {
        let refilled = self.left + rate.a_second * now.saturating_duration_since(self.at).as_secs_f64();
        self.left = refilled.min(rate.at_once);
        self.at = now;
        let is_left = self.left >= 1.0;
        if is_left {
            self.left -= 1.0;
        }
        is_left
    }
}

/// Buckets of those who take part. There are as many as there are signed tokens in use.
#[derive(Debug)]
pub struct RateLimits {
    participants: Mutex<HashMap<String, Bucket>>,
    begin: Mutex<Bucket>,
}

impl RateLimits {
    pub fn new() -> Self {
        Self { participants: Mutex::default(), begin: Mutex::new(Bucket::full(BEGIN, Instant::now())) }
    }

    /// Whether the participant `id`, whose token was verified, may ask now.
    pub fn allow_participant(&self, id: &str) -> bool {
        let now = Instant::now();
        let Ok(mut buckets) = self.participants.lock() else { return false };
        if !buckets.contains_key(id) {
            buckets.insert(id.to_owned(), Bucket::full(PARTICIPANT, now));
        }
        buckets.get_mut(id).is_some_and(|bucket| bucket.takes(PARTICIPANT, now))
    }

    /// Whether someone may begin now.
    pub fn allow_begin(&self) -> bool {
        self.begin.lock().is_ok_and(|mut bucket| bucket.takes(BEGIN, Instant::now()))
    }

    /// Drops the bucket of who has gone.
    pub fn forget(&self, id: &str) {
        if let Ok(mut buckets) = self.participants.lock() {
            buckets.remove(id);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_bucket_empties_and_fills_again() {
        let (rate, begun) = (Rate { at_once: 2.0, a_second: 10.0 }, Instant::now());
        let mut bucket = Bucket::full(rate, begun);
        let at = |ms| begun + Duration::from_millis(ms);
        assert!(bucket.takes(rate, begun) && bucket.takes(rate, begun) && !bucket.takes(rate, begun));
        assert!(!bucket.takes(rate, at(50)) && bucket.takes(rate, at(110)) && !bucket.takes(rate, at(120)));
        assert!(bucket.takes(rate, at(9000)) && bucket.takes(rate, at(9000)) && !bucket.takes(rate, at(9000)));
    }
}
