//! Settings that would make a run cheaper or better, each as a changed configuration.

use anyhow::Result;
use orator_dataset::config::Config;
use orator_onnx::{ModelRole, ModelState, ModelStore};
use orator_pipeline::pose2d::models;

/// The changes that can be timed here, each as `--set` takes it, with the configuration so changed: body models that are
/// there, the rate, how often people are looked for, no face.
///
/// # Errors
/// A manifest that is not sound.
pub fn changes(config: &Config) -> Result<Vec<(String, Config)>> {
    let settings = &config.settings;
    let store = ModelStore::open(&settings.models.dir)?;
    let chosen = models::choose(&settings.pose2d, &store)?;
    let changed = |set: String, change: &dyn Fn(&mut Config)| {
        let mut other = config.clone();
        change(&mut other);
        (set, other)
    };
    let mut changes = Vec::new();
    for entry in store.entries(&[])? {
        let is_there = entry.role == ModelRole::Body && matches!(store.state(entry), ModelState::Present);
        if is_there && entry.id != chosen.body {
            let set = format!("pose2d.body=\"{}\"", entry.id);
            changes.push(changed(set, &|other| other.settings.pose2d.body.clone_from(&entry.id)));
        }
    }
    let every = 2 * settings.pose2d.person_every.max(1);
    changes.push(changed(format!("pose2d.person_every={every}"), &|other| other.settings.pose2d.person_every = every));
    let fps = (settings.extract.fps * 2 / 3).max(1);
    changes.push(changed(format!("extract.fps={fps}"), &|other| other.settings.extract.fps = fps));
    if !chosen.face.is_empty() {
        changes.push(changed("pose2d.face=\"\"".to_owned(), &|other| other.settings.pose2d.face.clear()));
    }
    Ok(changes)
}
