//! Unit tests of `orator_dataset::config::load`.

use anyhow::Result;
use orator_base::stage::artifacts::StageName;
use orator_dataset::config::load::{Config, DEFAULT_FILE, resolve};
use orator_dataset::config::sections::Settings;
use orator_dataset::config::{GanRecipe, rules};
use std::collections::BTreeSet;
use std::path::Path;

fn resolved(text: &str, sets: &[&str]) -> Result<Config> {
    resolve(text, &sets.iter().map(|set| (*set).to_owned()).collect::<Vec<_>>(), "pipeline.toml".into())
}

fn problems(text: &str, sets: &[&str]) -> Vec<String> {
    let error = resolved(text, sets).map_or_else(|error| error.to_string(), |_| String::new());
    error.lines().skip(1).map(|line| line.trim().to_owned()).collect()
}

#[test]
fn the_documented_file_is_the_default() {
    let settings = resolved(DEFAULT_FILE, &[]).unwrap().settings;
    assert_eq!(Settings { speaker: Vec::new(), ..settings }, Settings::default());
    let one_speaker =
        Settings { speaker: vec![orator_dataset::config::SpeakerConfig::default()], ..Settings::default() };
    let defaults = toml::Table::try_from(one_speaker).unwrap();
    let (listed, advanced) = (keys(&DEFAULT_FILE.parse().unwrap()), advanced_keys());
    assert!(listed.len() <= 78 && listed.is_disjoint(&advanced), "{}", listed.len());
    assert_eq!(listed.union(&advanced).cloned().collect::<BTreeSet<_>>(), keys(&defaults));
}

/// `section.key` of all keys in the guide's tables of advanced keys; checks that the documented defaults and ranges
/// are those of the program.
fn advanced_keys() -> BTreeSet<String> {
    let (mut section, mut keys) = ("", BTreeSet::new());
    for line in include_str!("../../../../src/guide/configuration.md").lines() {
        if let Some(of) = line.strip_prefix("| **`[").and_then(|rest| rest.strip_suffix(".advanced]`** | | | |")) {
            section = of;
        }
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(|cell| cell.trim().trim_matches('`')).collect();
        let [name, default, _, range] = cells[..] else { continue };
        if section.is_empty() || name == "key" || name.starts_with(['-', '*']) {
            continue;
        }
        let key = format!("{section}.{name}");
        let written = format!("[{section}.advanced]\n{name} = {default}\n");
        let set = format!("{section}.{name}={default}");
        let own = resolved("", &[]).unwrap().settings;
        assert!(resolved(&written, &[]).unwrap().settings == own, "{key} is not {default}");
        assert!(resolved("", &[&set]).unwrap().settings == own, "{key} is not {default}");
        if let Some((_, (low, high, unit))) = rules::ranges().find(|(of, _)| *of == key) {
            assert_eq!(range, format!("{low} to {high} {unit}").trim_end(), "{key}");
        }
        assert!(keys.insert(key), "{name} is there twice");
    }
    keys
}

#[test]
fn a_key_is_read_in_its_section_and_in_the_advanced_table() {
    let read = |text: &str, sets: &[&str]| resolved(text, sets).unwrap().settings.gan;
    let expected = read("[gan]\nlambda_speed = 0.5\n", &[]);
    assert_eq!(expected.lambda_speed.given(), Some(0.5));
    assert_eq!(read("[gan.advanced]\nlambda_speed = 0.5\n", &[]), expected);
    assert_eq!(read("", &["gan.lambda_speed=0.5"]), expected);
    assert_eq!(read("[gan]\nlambda_speed = 1.0\n", &["gan.advanced.lambda_speed=0.5"]), expected);
    assert_eq!(
        problems("[gan]\nlambda_speed = 1.0\n[gan.advanced]\nlambda_speed = 0.5\nlambda_sped = 1\nseed = \"a\"\n", &[]),
        [
            "line 2: gan.lambda_speed: given in line 4 too, as gan.advanced.lambda_speed; keep one",
            "line 5: gan.advanced.lambda_sped: unknown key (did you mean lambda_speed?)",
            "line 6: gan.advanced.seed: expected an integer, found string",
        ]
    );
    assert_eq!(
        problems("[gan]\nadvanced = 3\n[segment.advansed]\nmax_jump = 1\n", &["lift.advanced.max_bone_change=7000"]),
        [
            "line 2: gan.advanced: expected a table, found integer",
            "line 3: segment.advansed: unknown key (did you mean advanced?)",
            "--set: lift.max_bone_change: 7000 is out of range: expected 0.01 to 100 bone lengths",
        ]
    );
}

/// `section.key` of all keys in a file.
fn keys(file: &toml::Table) -> BTreeSet<String> {
    let tables = |value: &toml::Value| match value {
        toml::Value::Array(entries) => entries.iter().filter_map(|entry| entry.as_table().cloned()).collect(),
        value => value.as_table().cloned().into_iter().collect::<Vec<_>>(),
    };
    let of = |(section, value): (&String, &toml::Value)| {
        let names = tables(value).into_iter().flat_map(|table| table.into_iter().map(|(key, _)| key));
        names.map(|key| format!("{section}.{key}")).collect::<Vec<_>>()
    };
    file.iter().flat_map(of).collect()
}

#[test]
fn a_former_key_is_named_with_its_replacement() {
    let message = "unknown key: replaced by min_own_voice, a probability instead of a correlation";
    let expected = ["line 2: segment", "--set: segment.advanced"].map(|at| format!("{at}.min_lip_sync: {message}"));
    assert_eq!(problems("[segment]\nmin_lip_sync = 0.1\n", &["segment.advanced.min_lip_sync=0.1"]), expected);
    assert_eq!(
        problems("[shard]\ntest = 0.2\n[seq2seq.advanced]\nlambda_reach = 0.5\n", &["segment.max_people=1"]),
        [
            "line 1: shard: unknown key: renamed to dataset",
            "line 4: seq2seq.advanced.lambda_reach: unknown key: renamed to seq2seq.lambda_variance",
            "--set: segment.max_people: unknown key: renamed to segment.max_persons",
        ]
    );
    let Config { settings, notes, .. } = resolved("[gan]\nrecipe = \"paper\"\n", &[]).unwrap();
    assert_eq!(settings.gan.recipe, GanRecipe::Rebol2021);
    let note = "gan.recipe = \"paper\" was renamed: write \"rebol2021\" (the old name works until version 0.4)";
    assert_eq!(notes, [format!("line 2: {note}")]);
}

#[test]
fn a_number_too_large_for_its_type_is_named() {
    let text = "[extract]\nfps = 5000000000\n[dataset]\ntest = 7.0\n";
    assert_eq!(
        problems(text, &["dataset.max_mb=4294967296"]),
        [
            "line 2: extract.fps: 5000000000 is too large",
            "line 4: dataset.test: 7 is out of range: expected 0 to 0.9",
            "line 4: dataset.test: validation and test leave less than 5 % for training",
            "--set: dataset.max_mb: 4294967296 is too large",
        ]
    );
}

#[test]
fn all_problems_are_reported_at_once_with_key_and_line() {
    let text =
        "[segment]\nshot_threshold = 7\n[extract]\nfsp = 15\n[work]\njobs = \"two\"\n[[speaker]]\nname = \"a b\"\n";
    assert_eq!(
        problems(text, &["gan.batch=0", "nothing=1", "lift.smooth_arms"]),
        [
            "line 2: segment.shot_threshold: 7 is out of range: expected 0 to 1",
            "line 4: extract.fsp: unknown key (did you mean fps?)",
            "line 6: work.jobs: expected an integer, found string",
            "line 7: speaker[0]: the key videos is missing",
            "line 8: speaker[0].name: \"a b\": expected letters, digits, - and _ (the name is used for folders)",
            "--set: lift.smooth_arms: expected KEY=VALUE, like extract.fps=15",
            "--set: gan.batch: 0 is out of range: expected 2 to 4096 windows",
            "--set: nothing: unknown key",
        ]
    );
}

#[test]
fn an_unknown_value_is_rejected_with_a_list_of_valid_ones() {
    for (set, expected) in [
        (
            "gan.preset=ligth",
            "unknown value \"ligth\": expected one of \"auto\", \"small\", \"light\", \"paper\" (did you mean light?)",
        ),
        ("pose2d.follow=`gpu`", "unknown value \"`gpu`\": expected \"largest\" or \"speaking\""),
        ("work.device=gpu", "invalid value \"gpu\": expected \"auto\", \"cpu\", \"cuda\" or \"cuda:N\""),
    ] {
        let (key, _) = set.split_once('=').unwrap();
        assert_eq!(problems("", &[set]), [format!("--set: {key}: {expected}")]);
    }
    let text = "[gan]\nrepresentation = \"position\"\npreset = 3\n";
    let found = problems(text, &[]);
    assert!(found[0].starts_with("line 2: gan.representation") && found[0].ends_with("(did you mean positions?)"));
    assert_eq!(found[1], "line 3: gan.preset: expected a string, found integer");
}

#[test]
fn words_are_recognised_for_the_speakers_that_ask_for_it() {
    let speaker = |name: &str, transcripts: &str| {
        format!("[[speaker]]\nname = \"{name}\"\nvideos = [\"a.mp4\"]\ntranscripts = {transcripts}\n")
    };
    let text = speaker("a", "\"auto\"") + &speaker("b", "[\"auto.srt\"]");
    let settings = resolved(&text, &["transcribe.language=en"]).unwrap().settings;
    let has_stage = ["a", "b"].map(|name| settings.stages_of(name).contains(&StageName::Transcribe));
    assert_eq!((has_stage, settings.transcribe.model_id()), ([true, false], "whisper-tiny-en"));
    assert_eq!(Settings::default().transcribe.model_id(), "whisper-base");
    let expected = [
        "line 4: speaker[0].transcripts: \"auto\" cannot be combined with files: keep one of them",
        "line 6: transcribe.language: invalid language \"English\": expected a code like \"en\", or \"\" to detect it",
        "--set: transcribe.model: no model: expected \"auto\" or a folder in models.dir",
    ];
    let text = speaker("a", "[\"auto\", \"a.srt\"]") + "[transcribe]\nlanguage = \"English\"\n";
    assert_eq!(problems(&text, &["transcribe.model="]), expected);
    let message = "whisper-tiny-en recognises English only: use whisper-base";
    let text = "[transcribe]\nmodel = \"whisper-tiny-en\"\nlanguage = \"de\"\n";
    assert_eq!(problems(text, &[]), [format!("line 3: transcribe.language: {message}")]);
}

#[test]
fn paths_are_relative_to_the_file_or_the_working_directory() {
    let text = "[models]\nonnxruntime = \"lib/ort.so\"\n[lift]\nbody_weights = \"/abs.safetensors\"\n\
                [[speaker]]\nname = \"work\"\nvideos = [\"a.mp4\"]\nreference = \"face.jpg\"\nsource = \"disk\"\n";
    let sets = ["lift.hand_weights=hands.safetensors".to_owned()];
    let settings = resolve(text, &sets, "/project/pipeline.toml".into()).unwrap().settings;
    assert_eq!(&*settings.work.dir, Path::new("/project/work"));
    assert_eq!(&*settings.models.onnxruntime, Path::new("/project/lib/ort.so"));
    assert_eq!(&*settings.lift.body_weights, Path::new("/abs.safetensors"));
    assert_eq!(&*settings.lift.hand_weights, std::env::current_dir().unwrap().join("hands.safetensors"));
    let speaker = &settings.speaker[0];
    assert_eq!((&*speaker.reference, speaker.source.as_str()), (Path::new("/project/face.jpg"), "disk"));
    assert_eq!((speaker.name.as_str(), settings.pose2d.person.as_str()), ("work", "auto"));
    assert!(settings.speaker[0].licence.is_empty());
}

#[test]
fn gap_limits_above_what_lift_fills_are_rejected() {
    let messages = problems("", &["segment.max_body_gap_secs=1.5", "segment.max_hand_gap_secs=60"]).join("\n");
    for key in ["segment.max_body_gap_secs: 1.5", "segment.max_hand_gap_secs: 60"] {
        assert!(
            messages
                .contains(&format!("{key} is out of range: expected 0 to 1 seconds, the longest gap that lift fills")),
            "{messages}"
        );
    }
}

#[test]
fn syntax_errors_name_the_line() {
    assert!(problems("[extract\nfps = 15", &[])[0].starts_with("line 1: not valid TOML"));
    assert!(problems("extract = 3", &[])[0].contains("expected a table"));
    assert!(problems("speaker = 3", &[])[0].contains("[[speaker]]"));
}
