//! The account of seconds that `orator status` shows: of every video what was kept, refused for which reason, lost to a
//! failed stage or is not judged yet, and whether that adds up to its duration.

use orator::external::ffmpeg::probe::probe;
use orator::pipeline::segment::Video;
use orator::stage::Unit;
use orator::stage::artifacts::{Artifact, StageName};
use orator::stage::ledger::{Ledger, longest_first};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// A frame at the lowest usual dataset rate: an account that is off by more does not add up.
const UNKNOWN_FRAME_SECS: f64 = 1.0 / 15.0;

/// How far a video has come.
pub enum Standing<'a> {
    /// Every stage up to `lift` is done: its ledger counts.
    Judged,
    /// A stage failed, with its error.
    Failed { stage: &'a str, error: &'a str },
    /// A stage is still to be run.
    Waiting,
}

/// Seconds of a video, or of several together.
#[derive(Clone, Debug, Default)]
pub struct Account {
    pub kept: f64,
    pub refused: BTreeMap<String, f64>,
    pub failed: f64,
    pub waiting: f64,
    /// Of the videos whose length is known.
    pub duration: f64,
    /// Videos whose length is not known: they failed before it was.
    pub n_unknown: usize,
    /// Videos whose seconds do not add up to their duration, to one frame.
    pub n_wrong: usize,
}

impl Account {
    /// The account of one video whose stages wrote under `work`; `extracted`: the extract stage is fresh.
    pub fn of(work: &Path, unit: &Unit, standing: Standing, extracted: bool) -> Self {
        let media = || Video::read(&Artifact::MediaInfo.path(work, unit)).ok();
        let media = if extracted { media() } else { None };
        let frame_secs = media.map_or(UNKNOWN_FRAME_SECS, |media| 1.0 / media.fps.per_sec());
        let duration = || media.map(|media| media.duration_secs).or_else(|| probed(&unit.source));
        let ledger = match standing {
            Standing::Judged => match Ledger::read(&Artifact::LiftLedger.path(work, unit)) {
                Ok(ledger) => Ok(Some(ledger)),
                Err(error) => Err((StageName::Lift.to_string(), format!("{error:#}"))),
            },
            Standing::Failed { stage, error } => Err((stage.to_owned(), error.to_owned())),
            Standing::Waiting => Ok(None),
        };
        let Some(duration) = duration() else { return Self { n_unknown: 1, ..Self::default() } };
        let (ledger, waiting) = match ledger {
            Ok(Some(ledger)) => (ledger, 0.0),
            Ok(None) => (Ledger::default(), duration),
            Err((stage, error)) => (Ledger::of_failure(duration, &stage, &error), 0.0),
        };
        // an empty sum is -0
        let (kept, refused, failed) = (ledger.kept_secs() + 0.0, ledger.refused_secs(), ledger.failed_secs() + 0.0);
        let sum = kept + refused.values().sum::<f64>() + failed + waiting;
        let n_wrong = usize::from((sum - duration).abs() > frame_secs);
        Self { kept, refused, failed, waiting, duration, n_unknown: 0, n_wrong }
    }

    /// Adds another account.
    pub fn add(&mut self, other: &Self) {
        self.kept += other.kept;
        for (reason, secs) in &other.refused {
            *self.refused.entry(reason.clone()).or_default() += secs;
        }
        self.failed += other.failed;
        self.waiting += other.waiting;
        self.duration += other.duration;
        self.n_unknown += other.n_unknown;
        self.n_wrong += other.n_wrong;
    }

    fn refused_secs(&self) -> f64 {
        self.refused.values().sum::<f64>() + 0.0
    }

    /// The heading of the table.
    pub fn heading(width: usize) -> String {
        let names = ["kept", "refused", "failed", "waiting", "duration"];
        let names = names.map(|name| format!("{name:>9}")).join("");
        format!("{:width$}{names}  refused for", "seconds")
    }

    /// A row of the table.
    pub fn row(&self, name: &str, width: usize) -> String {
        let known = self.duration > 0.0 || self.n_unknown == 0;
        let secs = [self.kept, self.refused_secs(), self.failed, self.waiting, self.duration];
        let secs = secs.map(|secs| if known { format!("{secs:9.2}") } else { format!("{:>9}", "?") }).join("");
        format!("{name:width$}{secs}  {}", longest_first(&self.refused)).trim_end().to_owned()
    }

    /// Whether all adds up, in words.
    pub fn verdict(&self) -> String {
        let unknown = match self.n_unknown {
            0 => String::new(),
            n => format!("; the length of {n} that failed is not known (?)"),
        };
        match self.n_wrong {
            0 => format!("kept + refused + failed + waiting = duration, to one frame a video{unknown}"),
            n => format!("the seconds of {n} do NOT add up to the duration: run the stage segment again{unknown}"),
        }
    }

    /// The same for programs.
    pub fn json(&self, name: &str) -> Value {
        let sum = self.kept + self.refused_secs() + self.failed + self.waiting;
        json!({
            "of": name, "kept_secs": self.kept, "refused_secs": self.refused, "failed_secs": self.failed,
            "waiting_secs": self.waiting, "duration_secs": self.duration, "sum_secs": sum,
            "unknown_durations": self.n_unknown, "adds_up": self.n_wrong == 0,
        })
    }
}

/// What the container says of a file that no stage could take in.
fn probed(source: &Path) -> Option<f64> {
    let secs = probe(source).ok()?.duration_secs?;
    (secs.is_finite() && secs > 0.0).then_some(secs)
}
