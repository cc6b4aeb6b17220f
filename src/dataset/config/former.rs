//! Former names of configuration keys. `pipeline.toml` and `--set` accept them with a note that names the current key;
//! records and checkpoints keep storing them, so that those of version 0.1 remain up to date.

use super::file::{ADVANCED, SourceLocation};
use serde::Serialize;
use serde_json::Value;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Former names of keys and sections, with their current names.
pub(super) const RENAMED: [(&str, &str); 12] = [
    ("shard", "dataset"),
    ("segment.max_bone_change", "lift.max_bone_change"),
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

/// Former keys whose values have no equivalent, with what replaced them.
pub(super) const REPLACED: [(&str, &str); 1] =
    [("segment.min_lip_sync", "replaced by min_own_voice, a probability instead of a correlation")];

/// Former value of `gan.recipe`, with its current name.
const RENAMED_RECIPE: (&str, &str) = ("paper", "rebol2021");

/// Settings of a section as records and checkpoints store them: JSON with the former names of renamed keys, in the same
/// order.
pub fn to_stored(section: &str, settings: &impl Serialize) -> serde_json::Result<Value> {
    let stored_name = |key: String| {
        let current = format!("{section}.{key}");
        let former = RENAMED.iter().find(|(_, now)| *now == current).and_then(|(former, _)| former.split_once('.'));
        former.filter(|(of, _)| *of == section).map_or(key, |(_, name)| name.to_owned())
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

/// Moves values given under former names, in a section or in its advanced table, to the current names; if both are
/// given, the current name takes precedence. Returns a note for each.
pub(super) fn rename(written: &mut DeTable<'_>, location_at: &dyn Fn(usize) -> SourceLocation) -> Vec<String> {
    let mut notes = Vec::new();
    let split = |name: &'static str| name.rsplit_once('.').map_or((None, name), |(table, key)| (Some(table), key));
    for (former, now) in RENAMED {
        let ((from, old), (to, new)) = (split(former), split(now));
        for is_advanced in [false, true].into_iter().filter(|advanced| !advanced || from.is_some()) {
            let Some((name, value)) = section(written, from, is_advanced).and_then(|table| table.remove_entry(old))
            else {
                continue;
            };
            let location = location_at(name.span().start);
            notes.push(format!("{location}{former} was renamed: write {now} (the old name works until version 0.3)"));
            let Some(table) = create_section(written, to, is_advanced, &name.span()) else { continue };
            match (table.get_mut(new).map(Spanned::get_mut), value.into_inner()) {
                (Some(DeValue::Table(table)), DeValue::Table(old)) => {
                    let missing = old.into_iter().filter(|(key, _)| !table.contains_key(key)).collect::<Vec<_>>();
                    table.extend(missing);
                }
                (Some(_), _) => {}
                (None, value) => {
                    table.insert(Spanned::new(name.span(), new.into()), Spanned::new(name.span(), value));
                }
            }
        }
    }
    for is_advanced in [false, true] {
        let Some(value) = section(written, Some("gan"), is_advanced).and_then(|gan| gan.get_mut("recipe")) else {
            continue;
        };
        if value.get_ref().as_str() == Some(RENAMED_RECIPE.0) {
            let location = location_at(value.span().start);
            let (old, new) = RENAMED_RECIPE;
            notes.push(format!(
                "{location}gan.recipe = {old:?} was renamed: write {new:?} (the old name works until version 0.3)"
            ));
            *value.get_mut() = DeValue::String(new.into());
        }
    }
    notes
}

/// Table of the section `name`, or its advanced table; the top-level table for `None`.
fn section<'t, 'a>(written: &'t mut DeTable<'a>, name: Option<&str>, is_advanced: bool) -> Option<&'t mut DeTable<'a>> {
    let Some(name) = name else { return Some(written) };
    let DeValue::Table(table) = written.get_mut(name)?.get_mut() else { return None };
    if !is_advanced {
        return Some(table);
    }
    match table.get_mut(ADVANCED)?.get_mut() {
        DeValue::Table(table) => Some(table),
        _ => None,
    }
}

/// [`section`], created at `span` if it does not exist.
fn create_section<'t, 'a>(
    written: &'t mut DeTable<'a>,
    name: Option<&'static str>,
    is_advanced: bool,
    span: &Range<usize>,
) -> Option<&'t mut DeTable<'a>> {
    let insert = |table: &mut DeTable<'a>, key: &'static str| {
        if !table.contains_key(key) {
            let empty = DeValue::Table(DeTable::new());
            table.insert(Spanned::new(span.clone(), key.into()), Spanned::new(span.clone(), empty));
        }
    };
    if let Some(name) = name {
        insert(written, name);
        if is_advanced {
            insert(section(written, Some(name), false)?, ADVANCED);
        }
    }
    section(written, name, is_advanced)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{GanSettings, Seq2seqSettings, Settings};

    #[test]
    fn stored_settings_have_their_former_names_and_are_read_back() {
        let settings = Settings::default();
        let stored = to_stored("pose2d", &settings.pose2d).unwrap();
        assert!(stored["person_follow"].is_number() && stored["box_smoothing"].is_null());
        assert!(to_stored("lift", &settings.lift).unwrap()["max_bone_change"].is_number());
        let seq2seq = to_stored("seq2seq", &Seq2seqSettings::default()).unwrap();
        assert_eq!((&seq2seq["reach"], &seq2seq["own_previous"]), (&"excursion".into(), &0.0.into()));
        assert_eq!(serde_json::from_value::<Seq2seqSettings>(seq2seq).unwrap(), Seq2seqSettings::default());
        let gan = GanSettings { final_lr_ratio: 0.25, ..GanSettings::default() };
        let stored = to_stored("gan", &gan).unwrap();
        assert_eq!(stored["fade_to"], 0.25);
        assert_eq!(serde_json::from_value::<GanSettings>(stored).unwrap(), gan);
    }
}
