//! Rate limits: a token bucket per participant, and one for all requests to begin.

use std::collections::HashMap;
use std::sync::Mutex;
use std::time::Instant;

/// Token bucket: capacity, refill rate per second and tokens left.
#[derive(Clone, Copy, Debug)]
struct Bucket {
    capacity: f64,
    per_second: f64,
    tokens: f64,
    updated: Instant,
}

impl Bucket {
    fn full(capacity: f64, per_second: f64) -> Self {
        Self { capacity, per_second, tokens: capacity, updated: Instant::now() }
    }

    /// Bucket of one participant, who needs about three tokens per trial.
    fn of_participant() -> Self {
        Self::full(100.0, 5.0)
    }

    /// Takes one token if available; returns whether it did.
    fn try_take(&mut self, now: Instant) -> bool {
        let refilled = self.tokens + self.per_second * now.saturating_duration_since(self.updated).as_secs_f64();
        (self.tokens, self.updated) = (refilled.min(self.capacity), now);
        let has_token = self.tokens >= 1.0;
        self.tokens -= if has_token { 1.0 } else { 0.0 };
        has_token
    }
}

/// Token buckets of the server. The map of participants is bounded: entries are created for verified tokens only.
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
        buckets.entry(id.to_owned()).or_insert_with(Bucket::of_participant).try_take(Instant::now())
    }

    /// Whether a new session may begin now.
    pub fn allow_begin(&self) -> bool {
        self.begin.lock().is_ok_and(|mut bucket| bucket.try_take(Instant::now()))
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
    fn a_bucket_empties_and_refills() {
        let mut bucket = Bucket::full(2.0, 10.0);
        let begun = bucket.updated;
        let at = |ms| begun + Duration::from_millis(ms);
        assert!(bucket.try_take(begun) && bucket.try_take(begun) && !bucket.try_take(begun));
        assert!(!bucket.try_take(at(50)) && bucket.try_take(at(110)) && !bucket.try_take(at(120)));
        assert!(bucket.try_take(at(9000)) && bucket.try_take(at(9000)) && !bucket.try_take(at(9000)));
    }
}
