//! Presets, and merging a study file onto one.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// Published study whose design serves as a preset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StudyPreset {
    /// Rebol, Guetl, Pietroszek 2021.
    Rebol,
    /// Kucherenko et al. 2021.
    Genea2020,
}

impl StudyPreset {
    pub const ALL: [Self; 2] = [Self::Rebol, Self::Genea2020];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Rebol => "rebol",
            Self::Genea2020 => "genea2020",
        }
    }

    /// Study file of the preset, without speakers and models.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Rebol => include_str!("rebol.toml"),
            Self::Genea2020 => include_str!("genea2020.toml"),
        }
    }
}

/// Merges `written` onto `base`: tables key by key, lists of named tables by name; others replace those of `base`.
pub(super) fn merge<'t>(written: DeTable<'t>, base: &mut DeTable<'t>) {
    for (key, value) in written {
        let Some(base_value) = base.get_mut(key.get_ref().as_ref()) else {
            base.insert(key, value);
            continue;
        };
        let span = value.span();
        let merged = match (std::mem::replace(base_value.get_mut(), DeValue::Boolean(false)), value.into_inner()) {
            (DeValue::Table(mut base_value), DeValue::Table(value)) => {
                merge(value, &mut base_value);
                DeValue::Table(base_value)
            }
            (DeValue::Array(mut base_value), DeValue::Array(entries))
                if base_value.iter().all(|entry| name_of(entry).is_some()) =>
            {
                entries.into_iter().for_each(|entry| merge_entry(entry, &mut base_value));
                DeValue::Array(base_value)
            }
            (_, value) => value,
        };
        // Errors are located at the text of the study file, not of the preset.
        *base_value = Spanned::new(span, merged);
    }
}

/// Merges a list entry onto the entry with the same name, or appends it.
fn merge_entry<'t>(entry: Spanned<DeValue<'t>>, base: &mut DeArray<'t>) {
    let span = entry.span();
    let existing = base.iter_mut().find(|other| name_of(other) == name_of(&entry));
    match (existing, entry.into_inner()) {
        (Some(existing), DeValue::Table(table)) => {
            if let DeValue::Table(mut base_value) = std::mem::replace(existing.get_mut(), DeValue::Boolean(false)) {
                merge(table, &mut base_value);
                *existing = Spanned::new(span, DeValue::Table(base_value));
            }
        }
        (_, entry) => base.push(Spanned::new(span, entry)),
    }
}

fn name_of<'v>(entry: &'v Spanned<DeValue<'_>>) -> Option<&'v str> {
    match entry.get_ref() {
        DeValue::Table(table) => match table.get("name")?.get_ref() {
            DeValue::String(name) => Some(name),
            _ => None,
        },
        _ => None,
    }
}

/// Byte ranges of all values in the file, by key: `clips.seconds`, `task[NAME].trials`, `hypothesis[0].kind`.
pub(super) fn spans(table: &DeTable<'_>) -> BTreeMap<String, Range<usize>> {
    let mut spans_by_key = BTreeMap::new();
    collect(table, "", &mut spans_by_key);
    spans_by_key
}

fn collect(table: &DeTable<'_>, prefix: &str, spans_by_key: &mut BTreeMap<String, Range<usize>>) {
    for (name, value) in table {
        let key = format!("{prefix}{}", name.get_ref());
        let end = value.span().end.max(name.span().end);
        spans_by_key.insert(key.clone(), name.span().start..end);
        match value.get_ref() {
            DeValue::Table(inner) => collect(inner, &format!("{key}."), spans_by_key),
            DeValue::Array(entries) => {
                for (at, entry) in entries.iter().enumerate() {
                    let DeValue::Table(inner) = entry.get_ref() else { continue };
                    let key = name_of(entry).map_or_else(|| format!("{key}[{at}]"), |name| format!("{key}[{name}]"));
                    spans_by_key.insert(key.clone(), entry.span());
                    collect(inner, &format!("{key}."), spans_by_key);
                }
            }
            _ => {}
        }
    }
}
