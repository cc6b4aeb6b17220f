//! Former names of configuration keys. Records and checkpoints keep storing them, so that those of version 0.1 remain up
//! to date; in `pipeline.toml` and `--set` they are errors that name the current key, except a value of version 0.2.

use super::file::{ADVANCED, SourceLocation};
use serde::Serialize;
use serde_json::Value;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Former names of keys, with their current names.
const RENAMED: [(&str, &str); 10] = [
    ("segment.max_people", "segment.max_persons"),
    ("segment.max_still_secs", "segment.max_static_secs"),
    ("pose2d.person_follow", "pose2d.box_smoothing"),
    ("gan.fade_to", "gan.final_lr_ratio"),
    ("gan.device", "work.device"),
    ("seq2seq.fade_from", "seq2seq.decay_start"),
    ("seq2seq.reach", "seq2seq.variance_loss"),
    ("seq2seq.lambda_reach", "seq2seq.lambda_variance"),
    ("seq2seq.own_previous", "seq2seq.rollout_previous"),
    ("seq2seq.hears_context", "seq2seq.audio_context"),
];

/// Other former keys and sections, with what replaced them.
const REPLACED: [(&str, &str); 3] = [
    ("shard", "renamed to dataset"),
    ("segment.max_bone_change", "renamed to lift.max_bone_change"),
    ("segment.min_lip_sync", "replaced by min_own_voice, a probability instead of a correlation"),
];

/// Former value of `gan.recipe`, with its current name.
const RENAMED_RECIPE: (&str, &str) = ("paper", "rebol2021");

/// Settings of a section as records and checkpoints store them: JSON with the former names of renamed keys, in the same
/// order.
pub fn to_stored(section: &str, settings: &impl Serialize) -> serde_json::Result<Value> {
    let stored_name = |key: String| {
        let current = format!("{section}.{key}");
        let former = RENAMED.iter().find(|(_, now)| *now == current).and_then(|(former, _)| former.split_once('.'));
        former.map_or(key, |(_, name)| name.to_owned())
    };
    Ok(match serde_json::to_value(settings)? {
        Value::Object(keys) => {
            // The device was a setting of the training; results of all devices are stored as those of the CPU.
            let device = (section == "gan").then(|| ("device".to_owned(), "cpu".into()));
            keys.into_iter().map(|(key, value)| (stored_name(key), value)).chain(device).collect()
        }
        value => value,
    })
}

/// What replaced the former key `key`, if it is one.
pub(super) fn renamed(key: &str) -> Option<String> {
    let renamed = RENAMED.iter().find(|(former, _)| *former == key).map(|(_, now)| format!("renamed to {now}"));
    renamed.or_else(|| REPLACED.iter().find(|(former, _)| *former == key).map(|(_, by)| (*by).to_owned()))
}

/// Replaces a former value of `gan.recipe`, in the section or in its advanced table. Returns a note for each.
pub(super) fn rename_recipe(written: &mut DeTable<'_>, location_at: &dyn Fn(usize) -> SourceLocation) -> Vec<String> {
    let (old, new) = RENAMED_RECIPE;
    let mut notes = Vec::new();
    let Some(DeValue::Table(gan)) = written.get_mut("gan").map(Spanned::get_mut) else { return notes };
    let mut rename = |section: &mut DeTable<'_>| {
        let Some(value) = section.get_mut("recipe").filter(|value| value.get_ref().as_str() == Some(old)) else {
            return;
        };
        let location = location_at(value.span().start);
        notes.push(format!(
            "{location}gan.recipe = {old:?} was renamed: write {new:?} (the old name works until version 0.4)"
        ));
        *value.get_mut() = DeValue::String(new.into());
    };
    rename(gan);
    if let Some(DeValue::Table(advanced)) = gan.get_mut(ADVANCED).map(Spanned::get_mut) {
        rename(advanced);
    }
    notes
}
