//! Poses as lines of JSON, written by a thread of their own: a reader that is slow misses poses, and does not delay them.

use super::pose::HumanoidBone;
use super::session::{PoseSink, SinkFacts, TimedPose};
use orator_base::math::rotation::Rotation;
use serde_json::{Map, Value, json};
use std::io::Write;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Number of lines that wait for the reader, one second.
const MAX_WAITING: usize = 60;

/// Longest time in which the last lines are delivered.
const MAX_END: Duration = Duration::from_secs(1);

pub struct JsonLines {
    bones: Arc<[HumanoidBone]>,
    /// `None` once the reader has gone.
    lines: Option<SyncSender<String>>,
    writer: JoinHandle<()>,
    n_sent: u64,
    n_dropped: u64,
}

impl JsonLines {
    pub fn new(mut out: impl Write + Send + 'static, bones: Arc<[HumanoidBone]>) -> Self {
        let (lines, waiting) = sync_channel::<String>(MAX_WAITING);
        let writer = std::thread::spawn(move || {
            for line in waiting {
                if out.write_all(line.as_bytes()).and_then(|()| out.flush()).is_err() {
                    return;
                }
            }
        });
        Self { bones, lines: Some(lines), writer, n_sent: 0, n_dropped: 0 }
    }
}

/// A pose as JSON: `secs`, `hips` (metres) and `rotations`, quaternions x, y, z, w by VRM name.
pub fn pose_json(bones: &[HumanoidBone], pose: &TimedPose) -> Value {
    let round = |number: f64| (number * 1e6).round() / 1e6;
    let rotation = |(bone, rotation): (&HumanoidBone, &Rotation)| {
        let Rotation { w, v: [x, y, z] } = *rotation;
        (bone.vrm.clone(), json!([x, y, z, w].map(round)))
    };
    let rotations: Map<String, Value> = bones.iter().zip(&pose.pose.rotations).map(rotation).collect();
    json!({ "secs": round(pose.secs), "hips": pose.pose.hips.map(round), "rotations": rotations })
}

impl PoseSink for JsonLines {
    fn send(&mut self, pose: &TimedPose) {
        let Some(lines) = &self.lines else { return self.n_dropped += 1 };
        match lines.try_send(format!("{}\n", pose_json(&self.bones, pose))) {
            Ok(()) => self.n_sent += 1,
            Err(error) => {
                self.n_dropped += 1;
                if matches!(error, TrySendError::Disconnected(_)) {
                    self.lines = None;
                }
            }
        }
    }

    fn is_closed(&self) -> bool {
        self.lines.is_none()
    }

    fn finish(&mut self) {
        // The thread of a reader that is stuck is left behind.
        self.lines = None;
        let end = Instant::now() + MAX_END;
        while !self.writer.is_finished() && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn facts(&self) -> SinkFacts {
        let note = (self.n_dropped > 0).then(|| "the reader of the lines was too slow, or has gone".to_owned());
        SinkFacts { name: "lines", n_sent: self.n_sent, n_dropped: self.n_dropped, note }
    }
}
