//! Every call that writes fails once, or is where the program is killed: it says so, and the same command ends in the
//! same bytes afterwards. `ORATOR_FAULTS=all` tries every call (`make prove`), another word those of the verbs with it among
//! their arguments; without, a few are drawn by lot.

use crate::fixtures::faults::scenes::{SCENES, Scene, content, copy, prepare, set_up};
use crate::fixtures::faults::shim::{Call, Fault, Shim, orator};
use orator_test_support::skip::skip;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Workers; each trial has a folder of its own.
const N_WORKERS: usize = 2;

/// A scene that ran without a fault.
struct Calm {
    scene: &'static Scene,
    /// The folder before the verb.
    start: PathBuf,
    /// What the folder holds afterwards; files that are not the same in every run are left out.
    end: BTreeMap<String, String>,
    /// Those left out: times and paths are in them.
    varying: BTreeSet<String>,
    calls: Vec<Call>,
}

fn calm(shim: &Shim, root: &Path, at: usize) -> Calm {
    let scene = &SCENES[at];
    let start = root.join(format!("start-{at}"));
    set_up(&root.join("base"), &start, scene);
    let run = |name: &str| {
        let place = root.join(format!("{name}-{at}"));
        copy(&start, &place);
        let (output, calls) = shim.calls(&place, scene.args);
        assert!(output.status.success(), "{:?}: {}", scene.args, said(&output));
        // A verb that is given twice: what the second one adds (a cache) is no difference.
        orator(&place, scene.args).output().unwrap();
        let content = content(&place);
        std::fs::remove_dir_all(&place).unwrap();
        (content, calls)
    };
    let (mut end, calls) = run("one");
    let (other, _) = run("other");
    let differs = |(name, hash): (&String, &String)| (other.get(name) != Some(hash)).then(|| name.clone());
    let varying: BTreeSet<String> = end.iter().filter_map(differs).collect();
    end.retain(|name, _| !varying.contains(name));
    Calm { scene, start, end, varying, calls }
}

fn said(output: &Output) -> String {
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

/// What is wrong with how a scene took a fault; none: nothing.
fn trial(shim: &Shim, calm: &Calm, call: &Call, fault: Fault, place: &Path) -> Option<String> {
    copy(&calm.start, place);
    let (output, was_reached) = shim.run(place, calm.scene.args, call, fault);
    if !was_reached {
        return None;
    }
    let whole = |place: &Path| {
        let mut now = content(place);
        now.retain(|name, _| !calm.varying.contains(name));
        let names: BTreeSet<&String> = now.keys().chain(calm.end.keys()).collect();
        let differ = names.into_iter().filter(|name| now.get(*name) != calm.end.get(*name));
        differ.map(|name| name.as_str().to_owned()).collect::<Vec<_>>()
    };
    let said = said(&output);
    match output.status.code() {
        _ if fault == Fault::Kill => {}
        None | Some(101) => return Some(format!("ended with {:?}: {said}", output.status)),
        Some(0) if is_cleaning(call) => {}
        Some(0) => {
            let lost = whole(place);
            if !lost.is_empty() {
                return Some(format!("exit code 0, but {lost:?} differ: {said}"));
            }
        }
        Some(_) if !names(&said, &call.path) => return Some(format!("the message names no file: {said}")),
        Some(_) => {}
    }
    // A try after one that had come to its end may be refused, since all is there; what a second look alone finds (a
    // cache) is no difference.
    let again = orator(place, calm.scene.args).output().unwrap();
    let mut differ = whole(place);
    if !differ.is_empty() && again.status.success() {
        orator(place, calm.scene.args).output().unwrap();
        differ = whole(place);
    }
    (!differ.is_empty()).then(|| format!("after the next try {differ:?} differ: {}", self::said(&again)))
}

/// Removing what is no longer needed may be left to the next run.
fn is_cleaning(call: &Call) -> bool {
    call.operation == "unlink"
}

/// Whether a message names the file, the file it is an attempt at, or a folder around it.
fn names(said: &str, path: &str) -> bool {
    if matches!(path, "" | ".") {
        return true; // the folder itself, of which any file says enough
    }
    let mut parts = path.rsplit('/').map(|part| part.trim_start_matches('.').split('.').next().unwrap_or_default());
    parts.by_ref().take(3).any(|part| !part.is_empty() && said.contains(part))
}

/// A number from 0 to 2^32 that a trial's place in the sample is drawn by.
fn lot(text: &str) -> u32 {
    u32::from_le_bytes(blake3::hash(text.as_bytes()).as_bytes()[..4].try_into().unwrap())
}

/// Tries `faults` at every call of every scene, or at `sample` of them, drawn by lot.
fn sweep(faults: &[Fault], sample: usize) {
    let Some(shim) = Shim::build() else { return skip("no C compiler") };
    let folder = tempfile::Builder::new().prefix("orator-faults-").tempdir().unwrap();
    let root = folder.path().canonicalize().unwrap();
    prepare(&root.join("base"));
    let wanted = std::env::var("ORATOR_FAULTS").ok();
    let is_whole = wanted.is_some();
    let is_wanted = |scene: &Scene| wanted.as_deref().is_none_or(|word| word == "all" || scene.args.contains(&word));
    let scenes: Vec<usize> = (0..SCENES.len()).filter(|at| is_wanted(&SCENES[*at])).collect();
    let calms = in_parallel(scenes.len(), |n, _| calm(&shim, &root, scenes[n]));
    let mut trials = Vec::new();
    for (calm, at) in calms.iter().zip(0..) {
        for call in chosen(&calm.calls) {
            trials.extend(faults.iter().map(|fault| (at, call.clone(), *fault)));
        }
    }
    let n_sites = calms.iter().flat_map(|calm| &calm.calls).map(|call| &call.site).collect::<BTreeSet<_>>().len();
    let n_all = trials.len();
    // In turns, so that every scene is among the first.
    trials.sort_by_cached_key(|(at, call, fault)| lot(&format!("{at} {} {} {fault:?}", call.operation, call.path)));
    let mut turns = BTreeMap::new();
    trials.sort_by_cached_key(|(at, ..)| {
        let turn = turns.entry(*at).or_insert(0);
        *turn += 1;
        (*turn, *at)
    });
    trials.truncate(if is_whole { n_all } else { sample });
    let wrong = in_parallel(trials.len(), |n, worker| {
        let (at, call, fault) = &trials[n];
        let place = root.join(format!("trial-{worker}"));
        let calm: &Calm = &calms[*at];
        let wrong = trial(&shim, calm, call, *fault, &place)?;
        let Call { operation, path, site, nth } = call;
        let text = format!("{:?}: {fault:?} at {operation} {path} ({site}, {nth}): {wrong}", calm.scene.args);
        eprintln!("{text}");
        Some(text)
    });
    let wrong: Vec<String> = wrong.into_iter().flatten().collect();
    eprintln!(
        "{} verbs, {n_sites} call sites, {} of {n_all} trials of {faults:?}: {} wrong",
        scenes.len(),
        trials.len(),
        wrong.len()
    );
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

/// `work` for every number below `n`, with the worker's number.
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
fn a_write_that_fails_or_is_the_last_is_told_and_the_next_try_ends_in_the_same_bytes() {
    sweep(&[Fault::InputOutput, Fault::NoSpace, Fault::Kill], 54);
}
