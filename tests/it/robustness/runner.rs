//! The runner with a toy stage: fresh is skipped, why it is not is said, a failed or panicking unit stops no other.

use orator_base::stage::fingerprint::{Fingerprint, HashCache};
use orator_base::stage::progress::{Progress, Silent};
use orator_base::stage::record::{Failure, failure_path};
use orator_base::stage::runner::{StageOutcome, State, run, state};
use orator_base::stage::{Input, Report, Stage, Unit};
use std::path::{Path, PathBuf};

/// Copies the source in upper case.
struct Shout {
    version: u32,
    mark: &'static str,
}

impl Stage for Shout {
    fn name(&self) -> &'static str {
        "shout"
    }
    fn version(&self) -> u32 {
        self.version
    }
    fn settings(&self, _unit: &Unit) -> serde_json::Value {
        serde_json::json!({ "shout": { "mark": self.mark } })
    }
    fn inputs(&self, unit: &Unit) -> anyhow::Result<Vec<Input>> {
        Ok(vec![Input { role: "text".into(), path: unit.source.clone() }])
    }
    fn run(&self, unit: &Unit, out: &Path, _progress: &dyn Progress) -> anyhow::Result<Report> {
        let text = std::fs::read_to_string(&unit.source)?;
        anyhow::ensure!(text != "bad", "{}: bad text", unit.source.display());
        assert!(text != "panic", "a defect");
        std::fs::write(out.join("loud.txt"), text.to_uppercase() + self.mark)?;
        Ok(Report { line: format!("{} letters", text.len()), ..Report::default() })
    }
}

fn units(dir: &Path, texts: &[(&str, &str)]) -> Vec<Unit> {
    let unit = |(name, text): &(&str, &str)| {
        let source: PathBuf = dir.join(name);
        std::fs::write(&source, text).unwrap();
        Unit { speaker: "host".into(), video: (*name).into(), source }
    };
    texts.iter().map(unit).collect()
}

#[test]
fn fresh_units_are_skipped_and_every_change_has_a_name() {
    let dir = tempfile::tempdir().unwrap();
    let work = dir.path().join("work");
    let hashes = HashCache::open(&work.join("hashes.json"));
    let units = units(dir.path(), &[("a", "one"), ("b", "two")]);
    let stage = Shout { version: 1, mark: "!" };
    let go = |stage: &Shout, force| run(stage, &units, &work, &hashes, (2, force), &Silent);
    let why = |stage: &Shout| match state(stage, &units[0], &work, &hashes) {
        State::UpToDate(record) => format!("fresh: {}", record.line),
        State::Stale(reason) => reason.to_string(),
        State::Failed(error) => error,
    };
    assert_eq!(why(&stage), "not run yet");
    assert!(go(&stage, false).iter().all(|ended| matches!(ended, StageOutcome::Done(_))));
    assert_eq!(why(&stage), "fresh: 3 letters");
    assert!(go(&stage, false).iter().all(|ended| matches!(ended, StageOutcome::Skipped(_))));
    assert!(go(&stage, true).iter().all(|ended| matches!(ended, StageOutcome::Done(_))));
    assert_eq!(why(&Shout { version: 2, ..stage }), "the stage changed from version 1 to 2");
    assert_eq!(why(&Shout { mark: "?", ..stage }), "shout.mark changed from \"!\" to \"?\"");
    std::fs::write(&units[0].source, "three").unwrap();
    assert_eq!(why(&stage), "the text changed");
    assert!(matches!(go(&stage, false)[..], [StageOutcome::Done(_), StageOutcome::Skipped(_)]));
    std::fs::remove_file(work.join("shout/host/a/loud.txt")).unwrap();
    assert_eq!(why(&stage), "output loud.txt is missing");
}

#[test]
fn a_failure_stops_no_other_and_keeps_what_was_made() {
    let dir = tempfile::tempdir().unwrap();
    let work = dir.path().join("work");
    let hashes = HashCache::open(&work.join("hashes.json"));
    let made = units(dir.path(), &[("a", "fine"), ("b", "bad"), ("c", "panic"), ("d", "good")]);
    let stage = Shout { version: 1, mark: "!" };
    let ended = run(&stage, &made, &work, &hashes, (1, false), &Silent);
    let errors: Vec<Option<String>> = ended
        .iter()
        .map(|ended| match ended {
            StageOutcome::Failed(error) => Some(format!("{error:#}")),
            _ => None,
        })
        .collect();
    assert!(errors[0].is_none() && errors[3].is_none());
    let message = |at: usize| errors[at].as_deref().unwrap();
    assert!(message(1).ends_with("bad text") && message(2).contains("a defect"));
    std::fs::write(&made[0].source, "bad").unwrap();
    assert!(matches!(run(&stage, &made[..1], &work, &hashes, (1, false), &Silent)[0], StageOutcome::Failed(_)));
    assert!(matches!(state(&stage, &made[0], &work, &hashes), State::Failed(_)));
    assert_eq!(std::fs::read_to_string(work.join("shout/host/a/loud.txt")).unwrap(), "FINE!");
}

#[test]
fn a_failure_that_is_over_does_not_stay_beside_a_record() {
    let dir = tempfile::tempdir().unwrap();
    let work = dir.path().join("work");
    let hashes = HashCache::open(&work.join("hashes.json"));
    let units = units(dir.path(), &[("a", "fine")]);
    let stage = Shout { version: 1, mark: "!" };
    let folder = units[0].dir(&work.join("shout"));
    let fingerprint = Fingerprint::now(&stage, &units[0], &hashes).unwrap();
    let fail = || Failure { fingerprint: Some(fingerprint.clone()), error: "late".into() }.write(&folder).unwrap();
    for done in [true, false] {
        fail();
        let ended = run(&stage, &units, &work, &hashes, (1, false), &Silent);
        assert!(matches!(ended[0], StageOutcome::Done(_)) == done, "{ended:?}");
        assert!(!failure_path(&folder).exists());
    }
}
