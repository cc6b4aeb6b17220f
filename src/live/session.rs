//! A session: one thread generates poses as their speech arrives, this one sends them at 60 Hz by the clock. A pose is
//! sent a constant time after its speech, see [`delay`].

use super::delays::Delays;
use super::pose::{HumanoidPose, LiveBody};
use super::rest::RestBlend;
use super::sound::{LATE_LIMIT, LiveSound, SoundFacts};
use anyhow::{Result, anyhow};
use orator_base::stage::progress::Progress;
use orator_base::types::time::FrameRate;
use orator_gesture::generate::GestureGenerator;
use serde::Serialize;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// Poses per second.
pub const RATE: u32 = 60;
/// Time for the computation of a frame.
const COMPUTATION: Duration = Duration::from_millis(40);
/// Number of frames that are generated ahead, if the sound is there.
const MAX_AHEAD: usize = 8;
/// Number of poses by which the clock may be late before poses are omitted.
const MAX_LATE: u32 = 3;

/// A pose with its time in the speech.
pub struct TimedPose {
    pub secs: f64,
    pub pose: HumanoidPose,
}

/// Receiver of poses. Sending does not wait.
pub trait PoseSink {
    fn send(&mut self, pose: &TimedPose);

    /// Whether nobody will receive further poses.
    fn is_closed(&self) -> bool {
        false
    }

    /// Waits until what was sent is delivered.
    fn finish(&mut self) {}

    fn facts(&self) -> SinkFacts;
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SinkFacts {
    pub name: &'static str,
    pub n_sent: u64,
    pub n_dropped: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// Time from speech to its pose, without the look-ahead: the allowed lateness of the sound, the wait for the next frame of
/// the network, between which and the last one poses are interpolated, and the computation. 167 ms at 15 fps.
pub fn delay(fps: FrameRate) -> Duration {
    LATE_LIMIT + Duration::from_secs_f64(1.0 / fps.per_sec()) + COMPUTATION
}

/// What a session did.
#[derive(Clone, Debug, Serialize)]
pub struct LiveReport {
    /// Seconds of motion that were sent.
    pub secs: f64,
    pub look_ahead_secs: f64,
    /// Time from speech to the pose for it beyond the look-ahead, ms.
    pub delay_ms: f64,
    /// Time from the arrival of the last sample that a frame depends on to the frame, ms: 99 % of frames, and all. Only
    /// for sound in real time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ready_ms: Option<[f64; 2]>,
    /// Deviation of the poses from the clock, ms: 99 % of poses, and all.
    pub jitter_ms: [f64; 2],
    /// Number of poses that repeat the one before because the network was late, and number of omitted ones.
    pub n_repeated: u64,
    pub n_omitted: u64,
    pub sound: SoundFacts,
    pub outputs: Vec<SinkFacts>,
}

/// Runs a session until its speech ends, all sinks are closed or `progress` requests a stop. A thread is reading the
/// `sound` already, in real time or, with `is_file`, as fast as it is used.
///
/// # Errors
/// A network that reads the complete speech; speech that cannot be read; network output that is not finite.
pub fn run(
    generator: &GestureGenerator,
    mut body: LiveBody,
    (sound, is_file): (&LiveSound, bool),
    sinks: &mut [&mut dyn PoseSink],
    progress: &dyn Progress,
) -> Result<LiveReport> {
    let look_ahead_secs = generator.look_ahead()?.secs;
    let delay = delay(generator.fps());
    // Speech that arrived while the model was loaded keeps its time.
    let start = sound.first_arrival().unwrap_or_else(Instant::now);
    let (sender, frames) = sync_channel(MAX_AHEAD);
    thread::scope(|scope| {
        let arrival = (!is_file).then_some(start);
        let body = &mut body;
        let generation = scope.spawn(move || generate(generator, body, sound, arrival, &sender));
        let zero = arrival.map(|start| start + Duration::from_secs_f64(look_ahead_secs) + delay);
        let mut clock =
            PoseClock { frames, fps: generator.fps().per_sec(), last: Vec::new(), n_frames: 0, is_over: false };
        let mut report = clock.run(zero, sound, sinks, progress);
        sound.close();
        drop(clock);
        let ended = generation.join().map_err(|_| anyhow!("the generation failed unexpectedly"));
        sinks.iter_mut().for_each(|sink| sink.finish());
        let ready = ended??;
        report.delay_ms = 1e3 * delay.as_secs_f64();
        report.look_ahead_secs = look_ahead_secs;
        report.ready_ms = (!is_file).then(|| [ready.quantile_ms(0.99), ready.max_ms()]);
        report.sound = sound.facts();
        report.outputs = sinks.iter().map(|sink| sink.facts()).collect();
        Ok(report)
    })
}

/// Generates frames until the sound ends or nobody receives them. Returns the times from the arrival of the last sample
/// that a frame depends on to the frame.
fn generate(
    generator: &GestureGenerator,
    body: &mut LiveBody,
    sound: &LiveSound,
    arrival: Option<Instant>,
    frames: &SyncSender<HumanoidPose>,
) -> Result<Delays> {
    let (fps, look_ahead_secs) = (generator.fps().per_sec(), generator.look_ahead()?.secs);
    let (blend, mut ready) = (RefCell::new(RestBlend::new()), Delays::new());
    let pieces = sound.pieces(arrival).inspect(|piece| {
        piece.iter().for_each(|piece| blend.borrow_mut().push(piece));
    });
    for (k, features) in generator.live_features(pieces, 1)?.enumerate() {
        let features = features?;
        if sound.n_samples_at_end().is_some_and(|n| generator.n_frames(n).unwrap_or(0) <= k) {
            break;
        }
        let at = k as f64 / fps;
        let pose = body.pose(&features, blend.borrow_mut().weight(at, 1.0 / fps))?;
        if let Some(start) = arrival {
            let needed = start + Duration::from_secs_f64(at + look_ahead_secs);
            ready.add(1e3 * Instant::now().saturating_duration_since(needed).as_secs_f64());
        }
        if frames.send(pose).is_err() {
            break;
        }
    }
    Ok(ready)
}

/// Interpolates frames to poses, and sends them by the clock.
struct PoseClock {
    frames: Receiver<HumanoidPose>,
    fps: f64,
    /// The last two frames.
    last: Vec<HumanoidPose>,
    n_frames: usize,
    is_over: bool,
}

impl PoseClock {
    /// Sends poses; the first at `zero`, or as soon as it is there.
    fn run(
        &mut self,
        zero: Option<Instant>,
        sound: &LiveSound,
        sinks: &mut [&mut dyn PoseSink],
        progress: &dyn Progress,
    ) -> LiveReport {
        let task = progress.begin("live", 0);
        let (mut jitter, mut n_repeated, mut n_omitted, mut said) = (Delays::new(), 0, 0, BTreeSet::new());
        let zero = zero.unwrap_or_else(|| {
            // A file has no arrival times: its clock begins with its second frame.
            while self.n_frames < 2 && !self.is_over {
                self.receive(true);
            }
            Instant::now()
        });
        let mut tick = 0u32;
        while !progress.is_to_stop() && !sinks.iter().all(|sink| sink.is_closed()) {
            let due = zero + Duration::from_secs(1) * tick / RATE;
            thread::sleep(due.saturating_duration_since(Instant::now()));
            let late = Instant::now().saturating_duration_since(due);
            if late * RATE > MAX_LATE * Duration::from_secs(1) {
                let n = (late * RATE).as_secs() as u32;
                n_omitted += if jitter.is_empty() { 0 } else { u64::from(n) };
                tick += n;
                continue;
            }
            let secs = f64::from(tick) / f64::from(RATE);
            let place = secs * self.fps;
            while self.n_frames as f64 <= place + 1.0 && self.receive(false) {}
            let last = self.n_frames as f64 - 1.0;
            if self.is_over && place > last {
                break;
            }
            if let Some(pose) = self.pose(place) {
                n_repeated += u64::from(place > last);
                jitter.add(1e3 * late.as_secs_f64());
                sinks.iter_mut().for_each(|sink| sink.send(&TimedPose { secs, pose: pose.clone() }));
            }
            tick += 1;
            if tick.is_multiple_of(RATE) {
                task.advance(1);
                let of_sinks =
                    sinks.iter().map(|sink| sink.facts()).filter_map(|facts| Some((facts.name, facts.note?)));
                let of_sound = sound.facts().notes.into_iter().map(|note| ("speech", note));
                for (about, note) in of_sinks.chain(of_sound) {
                    // Counts in the note of a sink change.
                    if said.insert(if about == "speech" { note.clone() } else { about.to_owned() }) {
                        progress.say(&format!("{about}: {note}"));
                    }
                }
            }
        }
        LiveReport {
            secs: f64::from(tick) / f64::from(RATE),
            look_ahead_secs: 0.0,
            delay_ms: 0.0,
            ready_ms: None,
            jitter_ms: [jitter.quantile_ms(0.99), jitter.max_ms()],
            n_repeated,
            n_omitted,
            sound: SoundFacts::default(),
            outputs: Vec::new(),
        }
    }

    /// Takes the next frame, if it is there; with `is_waiting` as soon as it is.
    fn receive(&mut self, is_waiting: bool) -> bool {
        let received = if is_waiting {
            self.frames.recv().map_err(|_| TryRecvError::Disconnected)
        } else {
            self.frames.try_recv()
        };
        match received {
            Ok(frame) => {
                self.last.truncate(1);
                self.last.insert(0, frame);
                self.n_frames += 1;
                return true;
            }
            Err(error) => self.is_over |= error == TryRecvError::Disconnected,
        }
        false
    }

    /// Pose at a fractional frame index, between the last two frames or the last one.
    fn pose(&self, place: f64) -> Option<HumanoidPose> {
        let newest = self.last.first()?;
        let before = self.last.get(1).unwrap_or(newest);
        let share = place - (self.n_frames as f64 - 2.0);
        Some(before.towards(newest, share.clamp(0.0, 1.0)))
    }
}
