//! Tests of `orator_dataset::import::find`.

use orator_dataset::import::find::{TakeFiles, find};
use orator_formats::mocap::captured::MotionKind;
use std::path::PathBuf;

#[test]
fn files_of_one_take_are_matched() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str, content: &str| {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, content).unwrap();
        path
    };
    let numbers = vec!["0.0"; 147].join(" ");
    let clip = file("clips/gt_interval_38.txt", &numbers);
    let clip_sound = file("clips/38.wav", "");
    let flat = file("flat/a.bvh", "");
    let flat_sound = file("flat/a.wav", "");
    let flat_words = ["flat/a.json", "flat/a.TextGrid"].map(|name| file(name, ""));
    let apart = file("set/bvh/b.BVH", "");
    let (apart_sound, apart_words) = (file("set/Wav/b.Flac", ""), file("set/TSV/b.TSV", ""));
    let alone = file("set/bvh/c.bvh", "");
    let notes = file("set/bvh/notes.txt", "words");
    let broken = file("d.npz", "no zip");
    let tar = file("train-000.tar", "");
    let found = find(&[dir.path().to_owned()], None).unwrap();
    let take = |kind, motion: &PathBuf, sound: Option<PathBuf>, transcripts: &[PathBuf]| TakeFiles {
        kind,
        motion: motion.clone(),
        sound,
        transcripts: transcripts.to_vec(),
        genea: None,
        origin: None,
    };
    let expected = [
        take(MotionKind::Authors, &clip, Some(clip_sound), &[]),
        take(MotionKind::Bvh, &flat, Some(flat_sound), &flat_words),
        take(MotionKind::Bvh, &apart, Some(apart_sound), &[apart_words]),
        take(MotionKind::Bvh, &alone, None, &[]),
    ];
    assert_eq!(found.takes, expected);
    assert_eq!((found.tars, found.unknown[0].0.clone(), found.passed_over), (vec![tar], broken, vec![notes]));
    assert_eq!(find(&[dir.path().to_owned()], Some(MotionKind::Authors)).unwrap().takes.len(), 1);
    let text = format!("{:#}", find(&[dir.path().join("flat/a.wav")], None).unwrap_err());
    assert!(text.contains("147 values"), "{text}");
    assert!(find(&[dir.path().join("gone")], None).is_err());
}
