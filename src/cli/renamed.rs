//! Names of version 0.1 that 0.2 still accepts: flags with a note that names the new flag, and keys of the `--json`
//! output, printed under both names. Version 0.3 removes them.

use orator_base::stage::artifacts::StageName;
use serde_json::{Map, Value};

/// Renamed flags, as (verb, old flag, new flag).
const FLAGS: [(&str, &str, &str); 12] = [
    ("animate", "--beside", "--compare"),
    ("animate", "--beside-from", "--compare-start"),
    ("animate", "--in-fps", "--input-fps"),
    ("evaluate", "--fps", "--input-fps"),
    ("generate", "--again", "--force"),
    ("import", "--no-sound", "--no-audio"),
    ("import", "--max-apart", "--max-length-difference"),
    (StageName::Lift.as_str(), "--fps", "--input-fps"),
    ("plan", "--piece", "--max-part"),
    ("plan", "--untimed", "--no-timing"),
    ("work", "--beat", "--heartbeat"),
    ("work", "--dead-after", "--claim-timeout"),
];

/// Renamed keys of the JSON output, as (verb, [(new key, old key)]).
const KEYS: [(&str, &[(&str, &str)]); 18] = [
    ("run", &[("up_to_date", "fresh"), ("accepted_secs", "kept_secs"), ("rejected_secs", "refused_secs")]),
    (
        "status",
        &[
            ("time_budget", "account"),
            ("unit", "of"),
            ("reason", "why"),
            ("reasons", "because"),
            ("up_to_date", "stay_fresh"),
            ("accepted_secs", "kept_secs"),
            ("rejected_secs", "refused_secs"),
            ("n_reclaimed", "n_taken_over"),
        ],
    ),
    ("work", &[("claim_lost", "laid_aside"), ("up_to_date", "fresh"), ("reclaimed", "taken_over")]),
    ("submit", &[("failed", "lost")]),
    ("models", &[("message", "said"), ("fetched", "had"), ("valid", "right")]),
    ("words", &[("message", "said")]),
    ("doctor", &[("problem", "wrong")]),
    ("dataset", &[("valid", "sound"), ("message", "what")]),
    ("forget", &[("retained_models", "kept_models"), ("term", "what")]),
    (
        "import",
        &[
            ("imported", "kept"),
            ("rejected", "refused"),
            ("outcome", "ended"),
            ("message", "says"),
            ("accepted_secs", "kept_secs"),
        ],
    ),
    ("align", &[("unaligned", "unfit")]),
    (StageName::Lift.as_str(), &[("frames_per_sec", "frames_a_second")]),
    (
        "sheet",
        &[
            ("metrics", "figures"),
            ("wrist_reprojection_mm", "wrist_off_mm"),
            ("hand_present_percent", "hand_there_percent"),
            ("hand_detected_percent", "hand_seen_percent"),
        ],
    ),
    ("report", &[("accepted_secs", "kept_secs"), ("rejected_secs", "refused_secs"), ("n_intervals", "n_stretches")]),
    ("animate", &[("detected", "seen")]),
    ("generate", &[("created", "made"), ("up_to_date", "fresh")]),
    (
        "evaluate",
        &[
            ("better_than_constant_pose", "better_than_nothing"),
            ("depends_on_audio", "hears"),
            ("conclusions", "verdicts"),
            ("trained_on_these_clips", "learnt_from_these_clips"),
            ("description", "says"),
            ("metric", "figure"),
            ("pairs", "beside"),
            ("rejected", "refused"),
        ],
    ),
    (
        "study",
        &[
            ("rejected", "refused"),
            ("conclusions", "verdicts"),
            ("n_participants_analysed", "n_participants_kept"),
            ("n_votes_analysed", "n_votes_kept"),
            ("hidden_share", "unseen"),
        ],
    ),
];

/// A note for each renamed flag in the arguments of a verb.
pub(super) fn flag_notes(verb: &str, arguments: impl Iterator<Item = String>) -> Vec<String> {
    let note = |argument: String| {
        let given = argument.split('=').next().unwrap_or_default();
        let (_, old, new) = FLAGS.iter().find(|(of, old, _)| *of == verb && *old == given)?;
        Some(format!("{old} was renamed: write {new} (the old name works until version 0.3)"))
    };
    arguments.filter_map(note).collect()
}

/// Adds the old names of renamed keys to the JSON output of a verb. A key `renamed_keys` of the outermost object maps
/// each old name to the new one.
pub(super) fn with_old_keys(verb: &str, mut output: Value) -> Value {
    let Some((_, keys)) = KEYS.iter().find(|(of, _)| *of == verb) else { return output };
    let mut added = Map::new();
    add_old_keys(keys, &mut output, &mut added);
    if let Value::Object(output) = &mut output
        && !added.is_empty()
    {
        output.insert("renamed_keys".to_owned(), Value::Object(added));
    }
    output
}

fn add_old_keys(keys: &[(&str, &str)], value: &mut Value, added: &mut Map<String, Value>) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(|item| add_old_keys(keys, item, added)),
        Value::Object(object) => {
            object.values_mut().for_each(|item| add_old_keys(keys, item, added));
            for (new, old) in keys {
                if let Some(value) = object.get(*new).filter(|_| !object.contains_key(*old)).cloned() {
                    object.insert((*old).to_owned(), value);
                    added.insert((*old).to_owned(), (*new).into());
                }
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn json_output_has_old_and_new_keys() {
        let printed = with_old_keys("import", json!({ "imported": 2, "takes": [{ "outcome": "failed" }] }));
        let expected = json!({
            "imported": 2, "kept": 2, "takes": [{ "outcome": "failed", "ended": "failed" }],
            "renamed_keys": { "kept": "imported", "ended": "outcome" },
        });
        assert_eq!(printed, expected);
        assert_eq!(with_old_keys("init", json!({ "imported": 2 })), json!({ "imported": 2 }));
    }

    #[test]
    fn a_renamed_flag_gives_a_note() {
        let notes = |arguments: &[&str]| flag_notes("generate", arguments.iter().map(|text| (*text).to_owned()));
        assert_eq!(notes(&["--again"]), ["--again was renamed: write --force (the old name works until version 0.3)"]);
        assert!(notes(&["--force", "again", "--beside=x"]).is_empty());
    }
}
