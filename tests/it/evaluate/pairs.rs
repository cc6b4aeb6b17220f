//! Pairs of clips.

use orator_gesture::evaluate::clips::pairs::find;

fn folder(names: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for name in names.split(' ') {
        std::fs::create_dir_all(dir.path().join(name).parent().unwrap()).unwrap();
        std::fs::write(dir.path().join(name), "").unwrap();
    }
    dir
}

#[test]
fn files_are_matched_by_name() {
    let dir = folder("t/a.npy t/gt_b.txt t/c.bvh t/notes.md t/.hidden.npy p/a.bvh p/pred_b.npy p/d.npy s/a.wav");
    let at = |name: &str| dir.path().join(name);
    let found = find(&at("t"), &at("p"), Some(&at("s"))).unwrap();
    let names: Vec<&str> = found.pairs.iter().map(|pair| pair.name.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
    assert_eq!((&found.pairs[0].sound, &found.pairs[1].sound), (&Some(at("s/a.wav")), &None));
    let notes = found.notes.join("|");
    assert!(notes.contains("c.bvh has no prediction") && notes.contains("d.npy has no truth"), "{notes}");
    assert!(notes.contains("b has no audio"), "{notes}");
    let alone = find(&at("t/a.npy"), &at("p/d.npy"), Some(&at("s/a.wav"))).unwrap();
    assert_eq!(alone.pairs[0].sound, Some(at("s/a.wav")));
}

#[test]
fn one_folder_may_hold_both_sides() {
    let dir = folder("gt_interval_7.txt prediction_interval_7.txt gt_interval_8.txt 7.wav README.txt");
    let found = find(dir.path(), dir.path(), Some(dir.path())).unwrap();
    assert_eq!((found.pairs.len(), found.pairs[0].name.as_str()), (1, "7"));
    assert_eq!(found.pairs[0].sound, Some(dir.path().join("7.wav")));
    assert_eq!(found.notes, ["gt_interval_8.txt has no prediction of the same name: left out"]);
}

#[test]
fn unmatched_inputs_are_rejected() {
    let dir = folder("t/a.npy t/b.npy p/c.npy q/a.npy q/a.bvh e/x.md s/z.wav r/a.npy r/b.npy");
    let error = |truth: &str, prediction: &str, audio: Option<&str>| {
        let at = |name: &str| dir.path().join(name);
        format!("{:#}", find(&at(truth), &at(prediction), audio.map(at).as_deref()).unwrap_err())
    };
    assert!(error("t", "p", None).contains("without a partner: a.npy has no prediction"));
    assert!(error("t", "q", None).contains("remove one of them"));
    assert!(error("e", "e", None).contains("no motion files"));
    assert!(error("t", "p/c.npy", None).contains("two files or two folders"));
    assert!(error("t/a.npy", "t/a.npy", None).contains("two different motions"));
    assert!(error("gone", "p", None).contains("does not exist"));
    assert!(error("t", "r", Some("s")).contains("expected for example a.wav"));
    assert!(error("t", "r", Some("s/z.wav")).contains("one audio file for 2 clips"));
}
