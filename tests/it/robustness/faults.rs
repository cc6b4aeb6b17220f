//! Every call that writes fails once, or is the point at which the program is killed: the error is reported, and a
//! retry writes identical bytes. `ORATOR_FAULTS=all` (`make prove`) tries every call, another word those of the verbs
//! with it among their arguments; by default a random sample is tried.

use crate::fixtures::faults::scenes::{SCENES, Scene, content, copy, prepare, set_up};
use crate::fixtures::faults::shim::{Call, Fault, Shim, orator};
use orator_test_support::skip::skip;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of workers; each has a separate folder.
const N_WORKERS: usize = 2;

/// A scene that ran without a fault.
struct Reference {
    scene: &'static Scene,
    /// The folder before the verb.
    start: PathBuf,
    /// Content of the folder afterwards, without the files in `varying`.
    end: BTreeMap<String, String>,
    /// Files that differ between runs, because they contain times or paths.
    varying: BTreeSet<String>,
    calls: Vec<Call>,
}

fn reference(shim: &Shim, root: &Path, at: usize) -> Reference {
    let scene = &SCENES[at];
    let start = root.join(format!("start-{at}"));
    set_up(&root.join("base"), &start, scene);
    let run = |name: &str| {
        let scratch = root.join(format!("{name}-{at}"));
        copy(&start, &scratch);
        let (output, calls) = shim.calls(&scratch, scene.args);
        assert!(output.status.success(), "{:?}: {}", scene.args, text_of(&output));
        // The verb runs twice, because what a second run adds (a cache) is not a difference.
        orator(&scratch, scene.args).output().unwrap();
        let content = content(&scratch);
        std::fs::remove_dir_all(&scratch).unwrap();
        (content, calls)
    };
    let (mut end, calls) = run("one");
    let (other, _) = run("other");
    let differs = |(name, hash): (&String, &String)| (other.get(name) != Some(hash)).then(|| name.clone());
    let varying: BTreeSet<String> = end.iter().filter_map(differs).collect();
    end.retain(|name, _| !varying.contains(name));
    Reference { scene, start, end, varying, calls }
}

fn text_of(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// The first, the second and the last call of each site.
fn chosen(calls: &[Call]) -> Vec<Call> {
    let mut last = BTreeMap::new();
    calls.iter().for_each(|call| {
        last.insert(&call.site, call.nth);
    });
    calls.iter().filter(|call| call.nth <= 2 || last[&call.site] == call.nth).cloned().collect()
}

/// Problem in the response of a scene to a fault; none if it was handled correctly.
fn trial(shim: &Shim, reference: &Reference, call: &Call, fault: Fault, scratch: &Path) -> Option<String> {
    copy(&reference.start, scratch);
    let (output, was_reached) = shim.run(scratch, reference.scene.args, call, fault);
    if !was_reached {
        return None;
    }
    let differences = |scratch: &Path| {
        let mut now = content(scratch);
        now.retain(|name, _| !reference.varying.contains(name));
        let names: BTreeSet<&String> = now.keys().chain(reference.end.keys()).collect();
        let differ = names.into_iter().filter(|name| now.get(*name) != reference.end.get(*name));
        differ.map(|name| name.as_str().to_owned()).collect::<Vec<_>>()
    };
    let text = text_of(&output);
    match output.status.code() {
        _ if fault == Fault::Kill => {}
        None | Some(101) => return Some(format!("ended with {:?}: {text}", output.status)),
        Some(0) if is_cleanup(call) => {}
        Some(0) => {
            let differ = differences(scratch);
            if !differ.is_empty() {
                return Some(format!("exit code 0, but {differ:?} differ: {text}"));
            }
        }
        Some(_) if !names_file(&text, &call.path) => return Some(format!("the message names no file: {text}")),
        Some(_) => {}
    }
    // A retry after a completed attempt may be rejected, since its output exists; what only a second retry adds (a
    // cache) is not a difference.
    let retry = orator(scratch, reference.scene.args).output().unwrap();
    let mut differ = differences(scratch);
    if !differ.is_empty() && retry.status.success() {
        orator(scratch, reference.scene.args).output().unwrap();
        differ = differences(scratch);
    }
    (!differ.is_empty()).then(|| format!("after a retry {differ:?} differ: {}", text_of(&retry)))
}

/// Removals of obsolete files may be left to the next run.
fn is_cleanup(call: &Call) -> bool {
    call.operation == "unlink"
}

/// Whether a message names the file, the target of an attempt file, or a parent folder.
fn names_file(text: &str, path: &str) -> bool {
    if matches!(path, "" | ".") {
        return true; // the folder itself, which any file name identifies
    }
    let mut parts = path.rsplit('/').map(|part| part.trim_start_matches('.').split('.').next().unwrap_or_default());
    parts.by_ref().take(3).any(|part| !part.is_empty() && text.contains(part))
}

/// Sort key that shuffles the trials reproducibly.
fn shuffle_key(text: &str) -> u32 {
    u32::from_le_bytes(blake3::hash(text.as_bytes()).as_bytes()[..4].try_into().unwrap())
}

/// Tries `faults` at every call of every scene, or at a random sample of `sample` calls.
fn sweep(faults: &[Fault], sample: usize) {
    let Some(shim) = Shim::build() else { return skip("no C compiler") };
    let folder = tempfile::Builder::new().prefix("orator-faults-").tempdir().unwrap();
    let root = folder.path().canonicalize().unwrap();
    prepare(&root.join("base"));
    let wanted = std::env::var("ORATOR_FAULTS").ok();
    let is_complete = wanted.is_some();
    let is_wanted = |scene: &Scene| wanted.as_deref().is_none_or(|word| word == "all" || scene.args.contains(&word));
    let scenes: Vec<usize> = (0..SCENES.len()).filter(|at| is_wanted(&SCENES[*at])).collect();
    let references = in_parallel(scenes.len(), |n, _| reference(&shim, &root, scenes[n]));
    let mut trials = Vec::new();
    for (reference, at) in references.iter().zip(0..) {
        for call in chosen(&reference.calls) {
            trials.extend(faults.iter().map(|fault| (at, call.clone(), *fault)));
        }
    }
    let n_sites =
        references.iter().flat_map(|reference| &reference.calls).map(|call| &call.site).collect::<BTreeSet<_>>().len();
    let n_all = trials.len();
    // Round-robin, so that the sample includes every scene.
    trials.sort_by_cached_key(|(at, call, fault)| {
        shuffle_key(&format!("{at} {} {} {fault:?}", call.operation, call.path))
    });
    let mut turns = BTreeMap::new();
    trials.sort_by_cached_key(|(at, ..)| {
        let turn = turns.entry(*at).or_insert(0);
        *turn += 1;
        (*turn, *at)
    });
    trials.truncate(if is_complete { n_all } else { sample });
    let problems = in_parallel(trials.len(), |n, worker| {
        let (at, call, fault) = &trials[n];
        let scratch = root.join(format!("trial-{worker}"));
        let reference: &Reference = &references[*at];
        let problem = trial(&shim, reference, call, *fault, &scratch)?;
        let Call { operation, path, site, nth } = call;
        let text = format!("{:?}: {fault:?} at {operation} {path} ({site}, {nth}): {problem}", reference.scene.args);
        eprintln!("{text}");
        Some(text)
    });
    let problems: Vec<String> = problems.into_iter().flatten().collect();
    eprintln!(
        "{} verbs, {n_sites} call sites, {} of {n_all} trials of {faults:?}: {} failed",
        scenes.len(),
        trials.len(),
        problems.len()
    );
    assert!(problems.is_empty(), "{} failed:\n{}", problems.len(), problems.join("\n"));
}

/// Runs `work` for every number below `n`, with the worker's number, and returns the results in order.
fn in_parallel<T: Send>(n: usize, work: impl Fn(usize, usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for worker in 0..N_WORKERS {
            let (next, done, work) = (&next, &done, &work);
            scope.spawn(move || {
                loop {
                    let at = next.fetch_add(1, Ordering::SeqCst);
                    if at >= n {
                        return;
                    }
                    let answer = work(at, worker);
                    done.lock().unwrap().push((at, answer));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap();
    done.sort_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, answer)| answer).collect()
}

#[test]
fn failed_or_last_writes_are_reported_and_a_retry_writes_the_same_bytes() {
    sweep(&[Fault::InputOutput, Fault::NoSpace, Fault::Kill], 54);
}
