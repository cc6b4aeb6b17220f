//! Poses of a live session (`orator live --page`) for the page: events that the browser receives as they are sent.

use orator_avatar::animate::avatar::{Appearance, Avatar};
use orator_avatar::animate::export::vrm;
use orator_live::lines::pose_json;
use orator_live::pose::{HumanoidBone, LiveBody};
use orator_live::session::{PoseSink, SinkFacts, TimedPose};
use orator_web::axum::response::sse::Event;
use serde_json::{Value, json};
use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::broadcast::{Receiver, Sender};

/// Number of poses that wait for a slow browser, half a second; then it misses poses.
const MAX_WAITING: usize = 30;
/// Time after which a browser connects again.
const RETRY: Duration = Duration::from_millis(200);

/// Longest time in which the last poses are delivered.
const MAX_END: Duration = Duration::from_secs(2);

/// A session as the page shows it.
#[derive(Clone)]
pub struct LiveFeed {
    name: String,
    /// The avatar, a VRM file.
    pub avatar: Arc<[u8]>,
    bones: Arc<[HumanoidBone]>,
    poses: Sender<Arc<str>>,
    n_sent: u64,
    n_missed: Arc<AtomicU64>,
}

impl LiveFeed {
    /// Feed of a session of the speaker `name`.
    pub fn new(name: &str, body: &LiveBody) -> Self {
        let avatar = Avatar::new(&body.rig, &Appearance::plain());
        Self {
            name: name.to_owned(),
            avatar: vrm::avatar(&body.rig, &avatar).into(),
            bones: body.bones.clone(),
            poses: Sender::new(MAX_WAITING),
            n_sent: 0,
            n_missed: Arc::default(),
        }
    }

    pub(crate) fn facts(&self) -> Value {
        json!({ "name": self.name, "hips_height": self.bones.first().map(|hips| hips.offset[1]) })
    }

    /// Events of a browser from now on: poses, and `end`.
    pub(crate) fn events(&self) -> impl futures_util::Stream<Item = Result<Event, Infallible>> + use<> {
        let state = (self.poses.subscribe(), self.n_missed.clone());
        futures_util::stream::unfold(state, async |(mut poses, n_missed)| {
            let event = next_event(&mut poses, &n_missed).await?;
            Some((Ok(event.retry(RETRY)), (poses, n_missed)))
        })
    }
}

async fn next_event(poses: &mut Receiver<Arc<str>>, n_missed: &AtomicU64) -> Option<Event> {
    loop {
        match poses.recv().await {
            Ok(pose) if pose.is_empty() => return Some(Event::default().event("end").data("end")),
            Ok(pose) => return Some(Event::default().data(pose)),
            Err(RecvError::Lagged(n)) => n_missed.fetch_add(n, Ordering::Relaxed),
            Err(RecvError::Closed) => return None,
        };
    }
}

impl PoseSink for LiveFeed {
    fn send(&mut self, pose: &TimedPose) {
        if self.poses.receiver_count() > 0 {
            self.n_sent += 1;
            let _ = self.poses.send(pose_json(&self.bones, pose).to_string().into());
        }
    }

    fn finish(&mut self) {
        let _ = self.poses.send("".into());
        // The server sends the last poses on its own threads; a browser that is stuck is not waited for.
        let end = Instant::now() + MAX_END;
        while !self.poses.is_empty() && Instant::now() < end {
            std::thread::sleep(RETRY / 10);
        }
        std::thread::sleep(RETRY);
    }

    fn facts(&self) -> SinkFacts {
        let n_dropped = self.n_missed.load(Ordering::Relaxed);
        let note = (n_dropped > 0).then(|| "a browser was too slow and missed poses".to_owned());
        SinkFacts { name: "page", n_sent: self.n_sent, n_dropped, note }
    }
}
