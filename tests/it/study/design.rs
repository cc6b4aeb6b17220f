//! Designs of studies: balance of clips, conditions and screen sides, attention checks, seeds.

use anyhow::Result;
use orator_study::design::{ClipNeeds, DesignedStudy, design};
use orator_study::file::{ClipReuse, FilmLayout, FilmSettings, StudyFile};
use orator_study::plan::{FilmContent, FilmSound, PlannedSession, TaskDesign, Trial, TrialPhase};
use orator_study::vote::{Response, ScreenSide};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

/// Film content by the name that the tests give it.
type Films = BTreeMap<String, FilmContent>;

fn designed(file: &StudyFile, n_clips: &[usize]) -> Result<(DesignedStudy, Films)> {
    let clips = file.speaker.iter().zip(n_clips).map(|(speaker, n)| {
        let names = (0..*n).map(|k| format!("{}/{k}", speaker.name)).collect();
        (speaker.name.clone(), names)
    });
    let mut films = Films::new();
    let mut film = |content: FilmContent| {
        let name = format!("{content:?}");
        films.insert(name.clone(), content);
        Ok(name)
    };
    let designed = design(file, &clips.collect(), &mut film)?;
    Ok((designed, films))
}

/// Study file with `tasks` of (design, trials, training trials) and `n_models` models, each with a mismatched
/// condition.
fn file(tasks: &[(TaskDesign, usize, usize)], n_speakers: usize, n_models: usize, more: &str) -> StudyFile {
    let mut text = format!("title = \"t\"\n{more}\n[[condition]]\nname = \"real\"\nkind = \"natural\"\n");
    for model in 0..n_models {
        let _ = writeln!(text, "[[condition]]\nname = \"m{model}\"\nkind = \"checkpoint\"\ncheckpoint = \"m\"");
        let _ = writeln!(text, "[[condition]]\nname = \"x{model}\"\nkind = \"mismatched\"\nof = \"m{model}\"");
    }
    for k in 0..n_speakers {
        let _ = writeln!(text, "[[speaker]]\nname = \"s{k}\"\ndataset = \"d\"");
    }
    for (at, (design, trials, training)) in tasks.iter().enumerate() {
        let design_name = serde_json::to_value(design).unwrap();
        let _ = writeln!(
            text,
            "[[task]]\nname = \"t{at}\"\ndesign = {design_name}\ntrials = {trials}\ntraining = {training}"
        );
        match design {
            TaskDesign::Sliders => text += "scale = \"appropriateness\"\n",
            TaskDesign::Preference => {}
            TaskDesign::Turing | TaskDesign::TuringSingle | TaskDesign::Mismatch => text += "feedback = true\n",
        }
    }
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("study.toml");
    std::fs::write(&path, text).unwrap();
    StudyFile::read(Path::new(&path)).unwrap()
}

fn check(file: &StudyFile, designed: &DesignedStudy, films: &Films) {
    let plan = &designed.plan;
    assert_eq!(plan.sessions.len(), file.n_sessions());
    let speech = |trial: &Trial| films[&trial.films[0]].clip.clone();
    for session in &plan.sessions {
        let trials = &session.trials;
        assert_eq!(trials.len(), plan.sessions[0].trials.len());
        let mut used_speech = BTreeSet::new();
        for trial in trials {
            assert!(trial.films.iter().all(|film| films[film].clip == speech(trial)));
            let block = if file.clips.reuse == ClipReuse::Never { 0 } else { trial.task };
            assert!(used_speech.insert((block, speech(trial))), "{} is repeated", speech(trial));
            let has_feedback = trial.phase == TrialPhase::Training && file.task[trial.task].feedback;
            assert_eq!(trial.expected.is_some(), has_feedback || trial.phase == TrialPhase::AttentionCheck);
        }
        assert!(trials[0].phase == TrialPhase::Practice || !file.practice);
        for (at, task) in file.task.iter().enumerate() {
            let of = |phase| trials.iter().filter(move |trial| trial.task == at && trial.phase == phase);
            assert_eq!((of(TrialPhase::Main).count(), of(TrialPhase::Training).count()), (task.trials, task.training));
            let first = |phase| trials.iter().position(|trial| trial.task == at && trial.phase == phase);
            assert!(task.training == 0 || first(TrialPhase::Training) < first(TrialPhase::Main));
            let mut n_of: BTreeMap<&str, usize> = file.speaker.iter().map(|s| (s.name.as_str(), 0)).collect();
            of(TrialPhase::Main).for_each(|trial| *n_of.get_mut(films[&trial.films[0]].speaker.as_str()).unwrap() += 1);
            assert!(n_of.values().max().unwrap() - n_of.values().min().unwrap() <= 1, "{n_of:?}");
        }
        let is_check = |trial: &Trial| trial.phase == TrialPhase::AttentionCheck;
        assert_eq!(trials.iter().filter(|trial| is_check(trial)).count(), file.attention_checks);
        assert!(!trials.iter().take(2).any(is_check));
        assert!(!trials.windows(2).any(|pair| is_check(&pair[0]) && is_check(&pair[1])));
        for trial in trials.iter().filter(|trial| is_check(trial)) {
            let numbers: Vec<u16> = trial.films.iter().filter_map(|film| films[film].number).collect();
            assert_eq!(trial.expected, Some(Response::Number(numbers[0])));
            assert!(numbers.len() == 1 && (10..=99).contains(&numbers[0]));
            let like = trials.iter().find(|other| other.task == trial.task && other.phase == TrialPhase::Main);
            assert_eq!(like.unwrap().films.len(), trial.films.len());
        }
    }
    for n in [file.participants, plan.sessions.len()] {
        balanced(file, &plan.sessions[..n], films);
    }
}

/// Counts the votes per cell from the contents of the films and asserts that they are balanced.
fn balanced(file: &StudyFile, sessions: &[PlannedSession], films: &Films) {
    for (at, task) in file.task.iter().enumerate() {
        let (mut cells, mut sides) = (BTreeMap::<_, usize>::new(), BTreeMap::<_, usize>::new());
        let trials = sessions.iter().flat_map(|session| &session.trials);
        for trial in trials.filter(|trial| trial.task == at && trial.phase == TrialPhase::Main) {
            let clip = films[&trial.films[0]].clip.clone();
            let shown: Vec<String> = trial.films.iter().map(|film| films[film].condition.clone()).collect();
            let set: BTreeSet<String> = shown.iter().cloned().collect();
            *cells.entry((clip.clone(), set)).or_default() += 1;
            *sides.entry((clip, shown)).or_default() += 1;
        }
        let range = |counts: &BTreeMap<_, usize>| counts.values().max().unwrap() - counts.values().min().unwrap();
        if task.design == TaskDesign::TuringSingle && task.conditions.len() > 2 {
            continue; // The real one is as frequent as all others.
        }
        assert!(range(&cells) <= 1, "{cells:?}");
        assert!(sides.values().max().unwrap() - sides.values().min().unwrap() <= 1, "{sides:?}");
    }
}

#[test]
fn the_papers_study_is_balanced_in_every_cell() {
    let tasks = [(TaskDesign::Turing, 20, 3), (TaskDesign::Mismatch, 10, 3)];
    let file = file(&tasks, 2, 1, "participants = 100\ntask_order = \"written\"");
    let needed = ClipNeeds::of(&file).total();
    assert_eq!(needed, 1 + 1 + 2 + 2 + 10 + 5);
    let (study, films) = designed(&file, &[needed, needed]).unwrap();
    check(&file, &study, &films);
    assert_eq!((study.balance[0].votes, study.balance[0].arranged), ([100, 100], [50, 50]));
    assert_eq!((study.balance[1].votes, study.balance[1].arranged), ([100, 100], [50, 50]));
    let expected_text = "t0: 100 votes in each of 20 cells, 50 in each order of films";
    assert_eq!(study.balance[0].to_string(), expected_text);
    for session in &study.plan.sessions {
        let is_left = |trial: &&Trial| {
            trial.task == 0 && trial.phase == TrialPhase::Main && films[&trial.films[0]].condition == "real"
        };
        assert_eq!(session.trials.iter().filter(is_left).count(), 10, "real ones on the left");
    }
    let training = study.plan.sessions.iter().flat_map(|session| &session.trials);
    for trial in training.filter(|trial| trial.task == 0 && trial.phase == TrialPhase::Training) {
        let is_left = films[&trial.films[0]].condition == "real";
        let side = if is_left { ScreenSide::Left } else { ScreenSide::Right };
        assert_eq!(trial.expected, Some(Response::Side(side)));
    }
}

#[test]
fn a_side_by_side_trial_has_one_film_of_both_avatars() {
    let tasks = [(TaskDesign::Turing, 6, 2), (TaskDesign::Mismatch, 4, 0), (TaskDesign::Preference, 3, 0)];
    let separate = file(&tasks, 2, 1, "participants = 6");
    let side_by_side = StudyFile { films: FilmSettings { layout: FilmLayout::SideBySide }, ..separate.clone() };
    let n_clips = [ClipNeeds::of(&separate).total(); 2];
    let [(two, two_films), (one, one_films)] = [&separate, &side_by_side].map(|file| designed(file, &n_clips).unwrap());
    let sessions = two.plan.sessions.iter().zip(&one.plan.sessions);
    for (two, one) in sessions.flat_map(|(two, one)| two.trials.iter().zip(&one.trials)) {
        assert_eq!((two.films.len(), one.films.len()), (2, 1));
        assert_eq!((two.task, two.phase, &two.expected), (one.task, one.phase, &one.expected));
        let (both, apart) = (&one_films[&one.films[0]], two.films.iter().map(|film| &two_films[film]));
        assert!(both.conditions().eq(apart.clone().map(|film| film.condition.as_str())));
        assert!(apart.clone().all(|film| film.clip == both.clip));
        assert_eq!(both.number, apart.clone().find_map(|film| film.number));
    }
    let sound_check = &one_films[&one.plan.sound_check];
    assert!(sound_check.right.is_some() && sound_check.sound == FilmSound::Tones);
}

#[test]
fn training_of_all_tasks_may_precede_the_first_main_trial() {
    let tasks = [(TaskDesign::Turing, 4, 2), (TaskDesign::Mismatch, 4, 3)];
    let of = |first: bool| {
        let file = file(&tasks, 1, 1, &format!("participants = 9\npractice = false\ntraining_first = {first}"));
        let (study, films) = designed(&file, &[ClipNeeds::of(&file).total()]).unwrap();
        check(&file, &study, &films);
        study.plan.sessions
    };
    let is_training = |trial: &Trial| trial.phase == TrialPhase::Training;
    for (by_task, first) in of(false).into_iter().zip(of(true)) {
        assert!(first.trials[..5].iter().all(is_training) && !by_task.trials[..5].iter().all(is_training));
        let kinds = |session: PlannedSession| session.trials.into_iter().partition::<Vec<Trial>, _>(is_training);
        assert_eq!(kinds(first), kinds(by_task), "the trials of each kind and their order are equal");
    }
}

#[test]
fn mismatched_clips_are_drawn_uniformly_for_each_session() {
    let of = |participants: usize, seed: u64, more: &str| {
        let head = format!("participants = {participants}\nseed = {seed}\n[clips]\n{more}");
        let file = file(&[(TaskDesign::Mismatch, 6, 2)], 1, 1, &head);
        let (study, films) = designed(&file, &[ClipNeeds::of(&file).total()]).unwrap();
        check(&file, &study, &films);
        (study.plan.sessions, films)
    };
    let drawn = "mismatched = \"per-participant\"";
    let (sessions, films) = of(600, 1, drawn);
    assert_eq!(of(10, 1, drawn).0[..], sessions[..15], "more participants change no earlier session");
    assert_ne!(of(10, 2, drawn).0[..], sessions[..15]);
    assert!(of(10, 1, "").1.values().all(|film| film.motion_of == film.clip), "fixed clips are not designed");
    let (mut counts, mut of_checks) = (BTreeMap::<_, u32>::new(), BTreeMap::<_, BTreeSet<_>>::new());
    let mut in_task = BTreeSet::new();
    for trial in sessions.iter().flat_map(|session| &session.trials) {
        for film in trial.films.iter().map(|film| &films[film]) {
            if film.condition != "x0" {
                assert_eq!(film.motion_of, film.clip);
                continue;
            }
            assert_ne!(film.motion_of, film.clip);
            match trial.phase {
                TrialPhase::Main => *counts.entry((&film.clip, &film.motion_of)).or_default() += 1,
                TrialPhase::AttentionCheck => _ = of_checks.entry(&film.clip).or_default().insert(&film.motion_of),
                TrialPhase::Practice | TrialPhase::Training => {}
            }
            if matches!(trial.phase, TrialPhase::Main | TrialPhase::Training) {
                in_task.insert(&film.clip);
            }
        }
    }
    // Six clips, each with the seven others of the task: 36 degrees of freedom; 80 is their 0.9999 quantile.
    assert_eq!((counts.len(), in_task.len()), (6 * 7, 8));
    assert!(counts.keys().all(|(_, other)| in_task.contains(other)));
    let expected = 900.0 / 7.0;
    let chi_square: f64 = counts.values().map(|n| (f64::from(*n) - expected).powi(2) / expected).sum();
    assert!(chi_square < 80.0, "{chi_square}: {counts:?}");
    assert!(of_checks.len() == 2 && of_checks.values().all(|others| others.len() == 1), "{of_checks:?}");
    let head = format!("participants = 1\nattention_checks = 0\n[clips]\n{drawn}");
    let single = file(&[(TaskDesign::Mismatch, 1, 0)], 1, 1, &head);
    let error = designed(&single, &[ClipNeeds::of(&single).total()]).unwrap_err().to_string();
    assert!(error.contains("needs at least 2"), "{error}");
}

#[test]
fn every_clip_occurs_equally_often_in_every_position() {
    let file = file(&[(TaskDesign::Turing, 8, 0)], 1, 1, "participants = 80\nattention_checks = 0\npractice = false");
    let (study, films) = designed(&file, &[ClipNeeds::of(&file).total()]).unwrap();
    let mut counts: BTreeMap<(usize, &str), usize> = BTreeMap::new();
    for session in &study.plan.sessions[..80] {
        for (position, trial) in session.trials.iter().enumerate() {
            *counts.entry((position, &films[&trial.films[0]].clip)).or_default() += 1;
        }
    }
    assert_eq!(counts.len(), 64);
    assert!(counts.values().all(|count| *count == 10), "{counts:?}");
}

#[test]
fn single_films_are_real_half_of_the_time() {
    let file = file(&[(TaskDesign::TuringSingle, 12, 0)], 1, 3, "participants = 9");
    let (study, films) = designed(&file, &[30]).unwrap();
    check(&file, &study, &films);
    for session in &study.plan.sessions {
        let main = session.trials.iter().filter(|trial| trial.phase == TrialPhase::Main);
        let n_real = main.filter(|trial| films[&trial.films[0]].condition == "real").count();
        assert!((5..=7).contains(&n_real), "{n_real}");
    }
}

#[test]
fn too_few_clips_are_rejected_with_the_number_needed() {
    let tasks = [(TaskDesign::Turing, 20, 3), (TaskDesign::Mismatch, 10, 3)];
    let file = file(&tasks, 1, 1, "participants = 10");
    let error = designed(&file, &[30]).unwrap_err().to_string();
    assert!(error.starts_with("39 clips per speaker are needed so that no clip is repeated in a session"), "{error}");
    assert!(
        error.contains("trials and training: 20 + 3 for t0, 10 + 3 for t1; attention checks: 2; practice: 1"),
        "{error}"
    );
    assert!(
        error.contains("but s0 has 30") && error.ends_with("reuse = \"other-tasks\" in [clips], which needs 26"),
        "{error}"
    );
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config::with_cases(48))]
    #[test]
    fn any_design_is_balanced_and_reproducible_by_its_seed(
        tasks in proptest::collection::vec((0usize..5, 3usize..12, 0usize..4), 1..4),
        n_speakers in 1usize..4, n_models in 1usize..4, participants in 1usize..25, seed in 0u64..1000,
        more in 0usize..7, n_checks in 0usize..3, reuse in proptest::bool::ANY, practice in proptest::bool::ANY,
    ) {
        let all = [TaskDesign::Turing, TaskDesign::TuringSingle, TaskDesign::Preference, TaskDesign::Sliders, TaskDesign::Mismatch];
        let tasks: Vec<_> = tasks.into_iter().map(|(design, trials, training)| (all[design], trials, training)).collect();
        let n_main: usize = tasks.iter().map(|task| task.1).sum();
        let n_checks = n_checks.min((n_main - 2) / 2);
        let reuse = if reuse { "reuse = \"other-tasks\"" } else { "" };
        let text = |seed: u64| format!("participants = {participants}\nseed = {seed}\nattention_checks = \
            {n_checks}\n\
                                        practice = {practice}\n[clips]\n{reuse}");
        let of_seed = |seed: u64| {
            let file = file(&tasks, n_speakers, n_models, &text(seed));
            let needed = ClipNeeds::of(&file).total();
            let n_clips: Vec<usize> = (0..n_speakers).map(|speaker| needed + more * (1 + speaker)).collect();
            (designed(&file, &n_clips).unwrap(), file)
        };
        let ((study, films), file) = of_seed(seed);
        check(&file, &study, &films);
        let ((again, _), _) = of_seed(seed);
        assert!(study == again);
        let ((other, _), _) = of_seed(seed + 1);
        assert!(study.plan.sessions != other.plan.sessions);
        for balance in &study.balance {
            assert!(balance.votes[1] - balance.votes[0] <= 1 && balance.arranged[1] - balance.arranged[0] <= 1);
        }
    }
}
