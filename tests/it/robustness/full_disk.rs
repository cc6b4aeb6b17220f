//! A full file system of the work folder is reported, and the run writes identical bytes once there is space again.

use crate::fixtures::faults::plan_workers::written;
use orator_test_support::project::Project;
use orator_test_support::skip::skip;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

/// Runs `orator` in the project with `work` on a separate file system of `size_kib`, whose content is copied from and
/// back to `saved`. None: the system does not let users mount.
fn run_in(project: &Project, size_kib: u64, args: &str) -> Option<Output> {
    // A mount exists in one namespace only, so its content is copied from run to run.
    let script = "mount -t tmpfs -o size=\"$1\"k tmpfs work && cp -a saved/. work && \
                  { \"$2\" --json $3; code=$?; rm -rf saved && cp -a work saved; exit $code; }";
    let mut command = Command::new("unshare");
    command.args(["--user", "--map-root-user", "--mount", "sh", "-c", script, "sh", &size_kib.to_string()]);
    command.arg(orator_test_support::project::program("orator")).arg(args).current_dir(project.dir());
    let output = command.output().ok()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    let is_denied = errors.lines().any(|line| line.starts_with("unshare:") || line.starts_with("mount:"));
    (!is_denied).then_some(output)
}

fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = written(folder);
    files.retain(|name, _| !name.contains(".attempt-"));
    files
}

#[test]
fn a_full_disk_is_reported_and_the_run_resumes_with_space() {
    let undisturbed = Project::with_clips("roomy", 2, 4.6);
    assert_eq!(undisturbed.run(&[]).code, 0);
    let expected = content(&undisturbed.work());
    let needed_kib = expected.values().map(|bytes| bytes.len().div_ceil(4096) as u64 * 4).sum::<u64>();
    let tight = Project::with_clips("tight", 2, 4.6);
    for folder in ["work", "saved"] {
        std::fs::create_dir_all(tight.dir().join(folder)).unwrap();
    }
    let mut codes = Vec::new();
    for tenths in [1, 3, 5, 7, 9] {
        let Some(output) = run_in(&tight, (needed_kib * tenths / 10).max(16), "run") else {
            return skip("no user namespace in which a file system can be mounted");
        };
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        let code = output.status.code();
        assert!(matches!(code, Some(1 | 2)), "{tenths} tenths: {code:?} {errors}");
        assert!(errors.contains("No space left on device") && !errors.contains("panicked"), "{tenths}: {errors}");
        codes.push(code);
    }
    let output = run_in(&tight, 4 * needed_kib + 4096, "run").unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let resumed = content(&tight.dir().join("saved"));
    assert_eq!(resumed.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    let differing: Vec<&String> =
        resumed.iter().filter(|(name, bytes)| expected[*name] != **bytes).map(|(n, _)| n).collect();
    assert!(differing.is_empty(), "{differing:?}");
    eprintln!("needed {needed_kib} KiB; runs with less exited with {codes:?}");
}
