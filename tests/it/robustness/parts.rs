//! The runner with a toy stage whose units have parts: idle workers help, finished parts are reused, and failures are
//! reported.

use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::parts::parts_folder;
use orator_base::stage::progress::{Progress, Silent};
use orator_base::stage::runner::{StageOutcome, run, run_parts};
use orator_base::stage::{Input, Report, Stage, Unit};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::thread::ThreadId;
use std::time::Duration;

/// Writes the letters of the source, one part per letter; `!` fails and `?` panics.
#[derive(Default)]
struct Spell {
    /// Finished parts, and the thread that ran each.
    done: Mutex<Vec<(String, ThreadId)>>,
}

impl Stage for Spell {
    fn name(&self) -> &'static str {
        "spell"
    }
    fn version(&self) -> u32 {
        1
    }
    fn settings(&self, _unit: &Unit) -> serde_json::Value {
        serde_json::Value::Null
    }
    fn inputs(&self, unit: &Unit) -> anyhow::Result<Vec<Input>> {
        Ok(vec![Input { role: "text".into(), path: unit.source.clone() }])
    }
    fn run(&self, unit: &Unit, out: &Path, _progress: &dyn Progress) -> anyhow::Result<Report> {
        let text = std::fs::read_to_string(&unit.source)?;
        std::fs::write(out.join("word.txt"), &text)?;
        Ok(Report { line: text, ..Report::default() })
    }
    fn n_parts(&self, unit: &Unit) -> anyhow::Result<usize> {
        Ok(std::fs::read_to_string(&unit.source)?.len())
    }
    fn run_part(&self, unit: &Unit, part: usize, out: &Path, _progress: &dyn Progress) -> anyhow::Result<()> {
        std::thread::sleep(Duration::from_millis(20));
        let letter = std::fs::read_to_string(&unit.source)?[part..=part].to_owned();
        assert!(letter != "?", "a defect");
        anyhow::ensure!(letter != "!", "letter {part} cannot be spelt");
        self.done.lock().unwrap().push((letter.clone(), std::thread::current().id()));
        Ok(std::fs::write(out.join("letter.txt"), letter)?)
    }
    fn join(&self, _unit: &Unit, parts: &[PathBuf], out: &Path) -> anyhow::Result<Report> {
        let letters = parts.iter().map(|part| std::fs::read_to_string(part.join("letter.txt")));
        let line = letters.collect::<Result<String, _>>()?;
        std::fs::write(out.join("word.txt"), &line)?;
        Ok(Report { line, ..Report::default() })
    }
}

struct Fixture {
    dir: tempfile::TempDir,
    hashes: HashCache,
    stage: Spell,
}

impl Fixture {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let hashes = HashCache::open(&dir.path().join("hashes.json"));
        Self { dir, hashes, stage: Spell::default() }
    }

    fn unit(&self, name: &str, text: &str) -> Unit {
        let source = self.dir.path().join(name);
        std::fs::write(&source, text).unwrap();
        Unit { speaker: "host".into(), video: name.into(), source }
    }

    fn work(&self) -> PathBuf {
        self.dir.path().join("work")
    }

    fn run(&self, units: &[Unit], jobs: usize) -> Vec<String> {
        let ended = run(&self.stage, units, &self.work(), &self.hashes, (jobs, false), &Silent);
        let text = |outcome| match outcome {
            StageOutcome::Done(report) => report.line,
            StageOutcome::Skipped(report) => format!("skipped {}", report.line),
            StageOutcome::Failed(error) => format!("failed: {error:#}"),
        };
        ended.into_iter().map(text).collect()
    }

    /// Letters spelt since the last call, sorted.
    fn spelt(&self) -> String {
        let mut letters: Vec<String> = self.stage.done.lock().unwrap().drain(..).map(|(letter, _)| letter).collect();
        letters.sort();
        letters.concat()
    }
}

#[test]
fn idle_workers_run_parts_and_every_part_runs_once() {
    let fixture = Fixture::new();
    let units = [fixture.unit("long", "abcdefghijklmno"), fixture.unit("short", "x"), fixture.unit("other", "pqr")];
    assert_eq!(fixture.run(&units, 4), ["abcdefghijklmno", "x", "pqr"]);
    let workers: BTreeSet<String> =
        fixture.stage.done.lock().unwrap().iter().map(|(_, thread)| format!("{thread:?}")).collect();
    assert!(workers.len() > 2, "{workers:?}");
    // A unit with one part is not split.
    assert_eq!(fixture.spelt(), "abcdefghijklmnopqr");
    assert!(!parts_folder(&fixture.work().join("spell/host/long")).exists());
    assert_eq!(fixture.run(&units, 1), ["skipped abcdefghijklmno", "skipped x", "skipped pqr"]);
    assert_eq!(fixture.spelt(), "");
}

#[test]
fn finished_parts_are_reused_until_the_unit_is_complete() {
    let fixture = Fixture::new();
    let bad = fixture.unit("word", "ab!d");
    assert_eq!(fixture.run(std::slice::from_ref(&bad), 1), ["failed: letter 2 cannot be spelt"]);
    assert_eq!(fixture.run(std::slice::from_ref(&bad), 1), ["failed: letter 2 cannot be spelt"]);
    assert_eq!(fixture.spelt(), "ab", "the second run reuses them");
    let defect = fixture.unit("word", "ab?d");
    assert!(fixture.run(&[defect], 2)[0].contains("internal error: a defect"));
    // Changed content invalidates the finished parts.
    fixture.spelt();
    let good = fixture.unit("word", "abcd");
    let part = |share| run_parts(&fixture.stage, &good, share, &fixture.work(), &fixture.hashes, &Silent).unwrap();
    part((1, 3));
    assert_eq!(fixture.spelt(), "b");
    part((2, 3));
    assert_eq!(fixture.spelt(), "cd");
    assert_eq!(fixture.run(std::slice::from_ref(&good), 2), ["abcd"]);
    assert_eq!(fixture.spelt(), "a");
    part((0, 3));
    assert_eq!(fixture.spelt(), "", "the unit is complete");
}
