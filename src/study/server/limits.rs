//! Rate limits: a token bucket for each participant, and one shared by all requests to begin.

use std::collections::HashMap;
use std::sync::Mutex;
use std::time::Instant;

/// Token bucket: capacity, refill rate per second and tokens left.
#[derive(Clone, Copy, Debug)]
struct Bucket {
    most: f64,
    a_second: f64,
    left: f64,
    at: Instant,
}

impl Bucket {
    fn full(most: f64, a_second: f64) -> Self {
        Self { most, a_second, left: most, at: Instant::now() }
    }

    /// Bucket of one participant, who needs about two tokens per trial.
    fn of_participant() -> Self {
        Self::full(100.0, 5.0)
    }

    /// Takes one token if available; returns whether it did.
    fn takes(&mut self, now: Instant) -> bool {
        let refilled = self.left + self.a_second * now.saturating_duration_since(self.at).as_secs_f64();
        (self.left, self.at) = (refilled.min(self.most), now);
        let is_left = self.left >= 1.0;
        self.left -= if is_left { 1.0 } else { 0.0 };
        is_left
    }
}

/// Token buckets of the server. The map of participants is bounded, because entries are created for verified tokens
/// only.
#[derive(Debug)]
pub struct RateLimits {
    participants: Mutex<HashMap<String, Bucket>>,
    begin: Mutex<Bucket>,
}

impl RateLimits {
    pub fn new() -> Self {
        Self { participants: Mutex::default(), begin: Mutex::new(Bucket::full(500.0, 10.0)) }
    }

    /// Whether the participant `id`, whose token was verified, may send a request now.
    pub fn allow_participant(&self, id: &str) -> bool {
        let Ok(mut buckets) = self.participants.lock() else { return false };
        buckets.entry(id.to_owned()).or_insert_with(Bucket::of_participant).takes(Instant::now())
    }

    /// Whether a new session may begin now.
    pub fn allow_begin(&self) -> bool {
        self.begin.lock().is_ok_and(|mut bucket| bucket.takes(Instant::now()))
    }

    /// Drops the bucket of a participant who withdrew.
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
        let mut bucket = Bucket::full(2.0, 10.0);
        let begun = bucket.at;
        let at = |ms| begun + Duration::from_millis(ms);
        assert!(bucket.takes(begun) && bucket.takes(begun) && !bucket.takes(begun));
        assert!(!bucket.takes(at(50)) && bucket.takes(at(110)) && !bucket.takes(at(120)));
        assert!(bucket.takes(at(9000)) && bucket.takes(at(9000)) && !bucket.takes(at(9000)));
    }
}
