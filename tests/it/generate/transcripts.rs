//! Transcripts of a batch.

use orator_gesture::batch::sounds::BatchSound;
use orator_gesture::batch::transcripts::find;

#[test]
fn transcripts_are_found_next_to_the_sound_or_in_a_folder() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    std::fs::create_dir_all(at("said/sub")).unwrap();
    for file in ["a.1.SRT", "a.srt", "b.json", "b.tsv", "said/b.vtt", "said/sub/c.txt", "own.ctm"] {
        std::fs::write(at(file), "").unwrap();
    }
    let sound = |audio: &str, name: &str, own: Option<&str>| BatchSound {
        audio: at(audio),
        name: name.into(),
        checkpoint: None,
        transcript: own.map(at),
    };
    let rows = [sound("a.1.wav", "a_1_wav", None), sound("b.mp3", "b", None), sound("c.wav", "sub/c", None)];
    let found = |folder: Option<&str>, more: Option<BatchSound>| {
        let mut rows: Vec<BatchSound> = rows.iter().cloned().chain(more).collect();
        find(&mut rows, folder.map(at).as_deref())?;
        anyhow::Ok(rows.into_iter().map(|row| row.transcript).collect::<Vec<_>>())
    };
    assert_eq!(found(None, None).unwrap(), [Some(at("a.1.SRT")), Some(at("b.tsv")), None]);
    let own = found(Some("said"), Some(sound("b.mp3", "d", Some("own.ctm")))).unwrap();
    assert_eq!(own, [None, Some(at("said/b.vtt")), Some(at("said/sub/c.txt")), Some(at("own.ctm"))]);
    // The JSON of a face tracker beside the words of an aligner.
    std::fs::write(at("c.json"), r#"{"names": ["jawOpen"], "frames": []}"#).unwrap();
    std::fs::write(at("c.ctm"), "c 1 0 1 so\n").unwrap();
    assert_eq!(found(None, None).unwrap()[2], Some(at("c.ctm")));
    assert!(found(Some("b.tsv"), None).unwrap_err().to_string().contains("not a folder"));
    std::fs::create_dir(at("empty")).unwrap();
    assert!(found(Some("empty"), None).unwrap_err().to_string().contains("no transcript in"));
}
