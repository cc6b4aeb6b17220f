//! Finds the plans that mention a video to be forgotten, with the folders of their workers. The caller removes them as
//! a whole: a plan without the video would have another seal, so nothing that refers to the old plan could continue.

use anyhow::{Context, Result};
use orator_dataset::forget::search::{SearchTerm, search};
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// Folder of excerpts that an `orator plan` of version 0.1 left if it was killed.
const FORMER_EXCERPTS: &str = "timing";

/// Paths in the work folder to remove: plans that contain one of the terms, with the folders of their workers; worker
/// folders of earlier plans that contain one; and former excerpts.
pub fn plans_naming(work: &Path, terms: &[SearchTerm]) -> Result<Vec<PathBuf>> {
    if !work.is_dir() {
        return Ok(Vec::new());
    }
    let listing = || format!("cannot list {}", work.display());
    let entries = fs::read_dir(work).with_context(listing)?.map(|entry| Ok(entry?.path()));
    let entries = entries.collect::<Result<BTreeSet<PathBuf>>>().with_context(listing)?;
    let holds_one =
        |path: &PathBuf| -> Result<bool> { Ok(!search(std::slice::from_ref(path), terms)?.hits.is_empty()) };
    let mut found = BTreeSet::new();
    for path in entries.iter().filter(|path| is_plan(path)) {
        if holds_one(path)? {
            found.insert(path.clone());
        }
    }
    for path in &entries {
        let Some(plan) = plan_of(path) else { continue };
        if found.contains(&plan) || holds_one(path)? {
            found.insert(path.clone());
        }
    }
    let excerpts = work.join(FORMER_EXCERPTS);
    let is_excerpt = |entry: &fs::DirEntry| Path::new(&entry.file_name()).extension().is_some_and(|it| it == "mkv");
    if fs::read_dir(&excerpts).is_ok_and(|mut entries| entries.all(|entry| entry.is_ok_and(|e| is_excerpt(&e)))) {
        found.insert(excerpts);
    }
    Ok(found.into_iter().collect())
}

/// Whether the file is a plan of any version, complete or not.
fn is_plan(path: &Path) -> bool {
    let is_json = path.extension().is_some_and(|ending| ending == "json") && path.is_file();
    let bytes = if is_json { fs::read(path).unwrap_or_default() } else { Vec::new() };
    let has = |key: &[u8]| bytes.windows(key.len()).any(|window| window == key);
    has(b"\"program\":") && has(b"\"units\":")
}

/// Path of the plan to which a folder of workers belongs; `None` if the folder's name does not end in a seal.
fn plan_of(folder: &Path) -> Option<PathBuf> {
    let (stem, seal) = folder.file_name()?.to_str()?.rsplit_once('-')?;
    let is_seal = seal.len() == 12 && seal.bytes().all(|byte| byte.is_ascii_hexdigit());
    // The name alone could be a date: every entry must be one that workers and `orator submit` create.
    let is_known = |name: &OsStr| ["claims", "workers", "jobs", "stop"].iter().any(|known| name == *known);
    let holds_only = |mut entries: fs::ReadDir| entries.all(|entry| entry.is_ok_and(|e| is_known(&e.file_name())));
    (is_seal && folder.read_dir().is_ok_and(holds_only)).then(|| folder.with_file_name(format!("{stem}.json")))
}
