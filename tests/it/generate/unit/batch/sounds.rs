//! Tests of `orator_gesture::batch::sounds`.

use orator_gesture::batch::sounds::{BatchSound, distinct, of_folder, parse};
use std::path::{Path, PathBuf};

#[test]
fn tables_of_all_dialects_are_read() {
    let row = |audio: &str, name: &str, checkpoint: Option<&str>| BatchSound {
        audio: PathBuf::from(audio),
        name: name.into(),
        checkpoint: checkpoint.map(PathBuf::from),
        transcript: None,
    };
    let read = |text: &str| parse(text, Path::new("t")).unwrap();
    assert_eq!(read("audio\na.wav\n\nsub/b.mp3"), [row("t/a.wav", "a", None), row("t/sub/b.mp3", "b", None)]);
    let text = "\u{feff}Out;Audio;speaker\r\n\"take \"\"1\"\".bvh\";\"a;b.wav\";host\r\nx/y;/c.wav;\r\n";
    assert_eq!(read(text), [row("t/a;b.wav", "take \"1\"", Some("t/host")), row("/c.wav", "x/y", None)]);
    let said = read("audio,transcript\na.wav,said.srt\nb.wav,\n").into_iter().map(|row| row.transcript);
    assert_eq!(said.collect::<Vec<_>>(), [Some(PathBuf::from("t/said.srt")), None]);
}

#[test]
fn errors_name_the_line() {
    for (text, words) in [
        ("", "empty"),
        ("out\na", "no column `audio`"),
        ("audio,loud\na.wav,1", "unknown column `loud`"),
        ("audio\n", "no audio files"),
        ("audio,out\na.wav,../b", "line 2"),
        ("audio,out\na.wav,/b", "line 2"),
        ("audio,out\n\n,b", "line 3: no audio"),
        ("audio\na.wav,b", "line 2: 2 fields for 1 column"),
        ("audio\n\"a.wav", "line 2: unclosed quotation mark"),
        ("audio,out\na.wav,Same\nb.wav,same.bvh", "a.wav and t/b.wav would both be written to `same`"),
    ] {
        let error = parse(text, Path::new("t")).and_then(distinct).unwrap_err();
        assert!(format!("{error:#}").contains(words), "{text:?}: {error:#}");
    }
}

#[test]
fn sounds_of_a_folder_have_unique_names() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("sub")).unwrap();
    for file in ["a.wav", "A.mp3", "b.WAV", "notes.txt", ".hidden.wav", "sub/a.wav"] {
        std::fs::write(dir.path().join(file), "").unwrap();
    }
    let names = |out: &str| -> Vec<String> {
        of_folder(dir.path(), &dir.path().join(out)).unwrap().0.into_iter().map(|row| row.name).collect()
    };
    assert_eq!(names("elsewhere"), ["A_mp3", "a_wav", "b", "sub/a"]);
    assert_eq!(names("sub"), ["A_mp3", "a_wav", "b"]);
    std::fs::write(dir.path().join("sub/scan.pdf"), "").unwrap();
    assert_eq!(of_folder(dir.path(), &dir.path().join("out")).unwrap().1, ["sub/scan.pdf"]);
    assert!(of_folder(dir.path(), dir.path()).unwrap_err().to_string().contains("--out-folder"));
    assert!(of_folder(&dir.path().join("none"), dir.path()).is_err());
}
