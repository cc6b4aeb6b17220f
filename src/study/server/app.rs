//! What the handlers of the server share.

use super::limits::RateLimits;
use super::secret::StudySecret;
use super::served::ServedStudy;
use crate::store::writer::ResponseStore;
use std::time::SystemTime;

/// The study, where its responses go, and who may ask how often.
pub struct App {
    pub study: ServedStudy,
    pub store: ResponseStore,
    pub secret: StudySecret,
    pub limits: RateLimits,
}

/// Milliseconds since 1970.
pub fn now_ms() -> i64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0, |since| since.as_millis() as i64)
}
