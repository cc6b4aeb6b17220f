//! Tests of `orator_study::file::read`.

use orator_study::file::{
    ConditionSource, EXAMPLE, FilmLayout, HypothesisKind, MismatchedClip, StudyFile, TaskOrder, resolve,
};
use std::collections::BTreeMap;
use std::path::Path;

const SMALLEST: &str = "title = \"t\"\npreset = \"rebol\"\n[[speaker]]\nname = \"ellen\"\ndataset = \"data\"\n\
                        [[condition]]\nname = \"model\"\nkind = \"checkpoint\"\ncheckpoint = \"models/{speaker}\"\n";

fn read(text: &str) -> StudyFile {
    resolve(text, Path::new("/s/study.toml")).unwrap()
}

fn problems(text: &str) -> Vec<String> {
    let found = resolve(text, Path::new("/s/study.toml")).err().unwrap_or_default();
    found.iter().map(ToString::to_string).collect()
}

#[test]
fn a_minimal_file_takes_all_settings_from_its_preset() {
    let file = read(SMALLEST);
    assert_eq!((file.participants, file.n_sessions(), file.task_order), (100, 150, TaskOrder::Written));
    assert_eq!((file.practice, file.training_first, file.exclusion.reloaded), (false, true, true));
    assert_eq!(file.clips.mismatched, MismatchedClip::PerParticipant);
    assert_eq!(file.drawn_conditions(), BTreeMap::from([("mismatched", "model")]));
    let tasks: Vec<_> = file.task.iter().map(|task| (task.trials, task.training, task.replay)).collect();
    assert_eq!(tasks, [(20, 3, false), (10, 3, false)]);
    assert_eq!((file.films.layout, file.films.layout.size()), (FilmLayout::SideBySide, [1000, 360]));
    assert_eq!(file.task[0].conditions, ["real", "model"]);
    assert_eq!(file.task[1].conditions, ["mismatched", "model"]);
    assert_eq!(file.find_condition("mismatched").unwrap().source, ConditionSource::Mismatched("model".into()));
    assert_eq!(file.find_condition("model").unwrap().source, ConditionSource::Checkpoint("/s/models/{speaker}".into()));
    assert_eq!(file.speaker[0].dataset.as_deref(), Some(Path::new("/s/data")));
    let model = |keys: &str| read(&format!("{SMALLEST}{keys}")).find_condition("model").unwrap().clone();
    let (plain, set) = (model(""), model("words = \"glove.safetensors\"\ncarry_state = true\n"));
    assert_eq!((plain.words, plain.carry_state), (None, false));
    assert_eq!((set.words, set.carry_state), (Some("/s/glove.safetensors".into()), true));
    let kinds: Vec<_> = file.hypothesis.iter().map(|hypothesis| hypothesis.kind).collect();
    use HypothesisKind::{DiffersFromChance, Equivalence, GreaterThanChance};
    assert_eq!(kinds, [DiffersFromChance, Equivalence, GreaterThanChance]);
}

#[test]
fn both_tasks_of_the_preset_ask_which_gestures_are_more_natural() {
    let wording = "feels as a more natural representation of gestures for the presented speech fragment";
    let file = read(&format!("languages = [\"en\", \"ar\"]\n{SMALLEST}"));
    assert_eq!(file.texts.keys().collect::<Vec<_>>(), ["ar", "en"], "the texts of other languages are dropped");
    for task in ["real-or-generated", "matched-or-mismatched"] {
        assert!(file.texts["en"][&format!("question.{task}")].contains(wording));
        let keys = ["question", "title", "instructions"].map(|part| format!("{part}.{task}"));
        assert!(file.texts.values().all(|texts| keys.iter().all(|key| texts.contains_key(key))));
    }
    let removed = "[[task]]\nname = \"matched-or-mismatched\"\ntrials = 0\n";
    let own = "[texts.en]\n\"question.real-or-generated\" = \"Which?\"\n";
    let file = read(&format!("{SMALLEST}{removed}{own}"));
    let texts = &file.texts["en"];
    assert_eq!((texts.len(), texts["question.real-or-generated"].as_str()), (3, "Which?"));
    let wrong = problems(&format!("{SMALLEST}{removed}[texts.en]\n\"title.matched-or-mismatched\" = \"Which?\"\n"));
    assert!(wrong[0].contains("texts.en.title.matched-or-mismatched: unknown text of the page"), "{wrong:?}");
    assert!(problems(&format!("{SMALLEST}[texts.de]\n"))[0].contains("\"de\" is not in languages"));
}

#[test]
fn a_file_is_merged_onto_its_preset_by_name() {
    let text = format!(
        "participants = 7\nattention_checks = 1\n{SMALLEST}[[task]]\nname = \"matched-or-mismatched\"\n\
                        trials = 0\n[[task]]\nname = \"real-or-generated\"\ntrials = 5\n[exclusion]\nstalled_secs = 9\n"
    );
    let file = read(&text);
    assert_eq!((file.participants, file.task.len(), file.task[0].trials, file.task[0].training), (7, 1, 5, 3));
    assert_eq!(read(&format!("spare = 0.25\n{SMALLEST}")).n_sessions(), 125, "the former name of a key");
    assert_eq!((file.exclusion.stalled_secs, file.exclusion.unfocused_secs), (Some(9.0), Some(5.0)));
}

#[test]
fn the_challenge_preset_mismatches_natural_motion_in_audio_tasks() {
    let file = read(&SMALLEST.replace("rebol", "genea2020"));
    assert_eq!((file.films.layout, file.films.layout.size()), (FilmLayout::Separate, [800, 600]));
    assert_eq!(file.task[0].conditions, ["natural", "model"]);
    assert_eq!(file.task[1].conditions, ["natural", "mismatched", "model"]);
    assert_eq!((file.task[0].sound, file.task[1].sound, file.exclusion.failed_checks), (false, true, Some(2)));
}

#[test]
fn the_example_is_valid_and_resolved_files_round_trip() {
    let file = read(EXAMPLE);
    assert_eq!(file.hypothesis[0].points, Some(10.0));
    let dir = tempfile::tempdir().unwrap();
    let dropped = format!("{SMALLEST}[[task]]\nname = \"matched-or-mismatched\"\ntrials = 0\n");
    let bare = SMALLEST.replace("preset = \"rebol\"", "participants = 3")
        + "[exclusion]\nincomplete = false\n[[condition]]\nname = \"real\"\nkind = \"natural\"\n\
               [[task]]\nname = \"single\"\ndesign = \"turing-single\"\ntrials = 9\n";
    let set = read(&format!("{SMALLEST}words = \"glove.safetensors\"\ncarry_state = true\n"));
    let genea = read(&SMALLEST.replace("rebol", "genea2020"));
    for file in [file, read(SMALLEST), set, genea, read(&dropped), read(&bare)] {
        let path = dir.path().join("study.toml");
        file.write(&path).unwrap();
        assert_eq!(StudyFile::read(&path).unwrap(), file);
        // Files of studies built before the key existed stay equal.
        let has_layout = std::fs::read_to_string(&path).unwrap().contains("[films]");
        assert_eq!(has_layout, file.films.layout == FilmLayout::SideBySide);
    }
}

#[test]
fn each_problem_states_line_key_and_remedy() {
    let one = |text: &str| problems(&format!("{SMALLEST}{text}"));
    assert!(one("[clips]\nsecond = 3\n")[0].starts_with("line 11: clips.second: unknown key (did you mean seconds?)"));
    assert!(one("[[task]]\nname = \"x\"\ntrials = 3\n")[0].ends_with("the key design is missing"));
    assert_eq!(
        one("[texts.en]\n\"study.titel\" = \"Hi\"\n"),
        ["line 11: texts.en.study.titel: unknown text of the page (did you mean study.title?)"]
    );
    let wrong = one("[[task]]\nname = \"x\"\ndesign = \"sliders\"\ntrials = 3\nscale = \"appropriate\"\n\
                     [films]\nlayout = \"separate\"\n");
    assert_eq!(
        wrong,
        ["line 14: task[x].scale: \"appropriate\": expected human-likeness or appropriateness \
                        (did you mean appropriateness?)"]
    );
    assert_eq!(
        one("[[task]]\nname = \"x\"\ndesign = \"turing-single\"\ntrials = 3\n"),
        ["line 2: films.layout: a side-by-side film shows two avatars, which does not fit the task x: expected \
          \"separate\", or only tasks of the designs turing, preference and mismatch"]
    );
    assert!(one("[films]\nlayout = \"beside\"\n")[0].starts_with("line 11: films.layout: unknown value \"beside\""));
    let wrong = one("[[task]]\nname = \"x\"\ndesign = \"turin\"\ntrials = 3\n");
    assert!(wrong[0].starts_with("line 12: task[x].design: unknown value \"turin\""), "{wrong:?}");
    assert!(wrong[0].ends_with("(did you mean turing?)"), "{wrong:?}");
    assert_eq!(
        one("[[condition]]\nname = \"b\"\nkind = \"files\"\n"),
        ["line 6: condition[model]: condition b: missing key files: expected for example files = \
             \"other/{clip}.bvh\""]
    );
    assert_eq!(
        one("[[condition]]\nname = \"b\"\nkind = \"natural\"\ncarry_state = true\n"),
        ["line 6: condition[model]: condition b: the keys words and carry_state apply to the kind checkpoint; \
          remove them"]
    );
    assert_eq!(
        one("[[hypothesis]]\ntask = \"real-or-generated\"\nkind = \"differs\"\n[[hypothesis]]\n\
             task = \"real-or-fake\"\nkind = \"equivalence\"\n"),
        [
            "line 12: hypothesis[0].kind: does not fit the task real-or-generated: expected differs-from-chance, \
             greater-than-chance or equivalence",
            "line 14: hypothesis[1].task: unknown task \"real-or-fake\": expected one of real-or-generated, \
             matched-or-mismatched",
        ]
    );
    assert!(problems("title = \"t\"\npreset = \"rebel\"\n")[0].ends_with("(did you mean rebol?)"));
    assert!(problems("title = \"t\"\n")[0].ends_with("the key participants is missing"));
    assert!(problems("title = 3\nparticipants = 4\n")[0].starts_with("line 1: title: invalid type"));
    assert!(problems("[x")[0].starts_with("line 1: not valid TOML"));
    let bare = problems("title = \"\"\npreset = \"rebol\"\nseed = 3\n").join("\n");
    for expected in ["title: expected a title", "no speakers", "condition[mismatched].of: expected the name"] {
        assert!(bare.contains(expected), "{expected}: {bare}");
    }
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config::with_cases(128))]
    #[test]
    fn no_text_panics(
        text in "(\\[?\\[?(task|speaker|clips|texts|condition|preset|[a-z]{1,4})[\\].=]?[a-z_]{0,6} ?=? ?[\"0-9a-z.\\[\\]{}-]{0,8}\n){0,8}|.{0,60}",
    ) {
        let _ = resolve(&text, Path::new("study.toml"));
    }
}
