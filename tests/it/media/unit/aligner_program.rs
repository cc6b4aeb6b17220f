//! Tests of `orator_media::aligner::program`.

use orator_media::aligner::program::{AlignedWord, Aligner, SpokenWord, header, times};
use std::path::Path;

#[test]
fn words_and_times_are_exchanged_as_lines() {
    let words = [("so\u{7}", None), ("well", Some((0.5, 2.0)))];
    let words = words.map(|(word, within)| SpokenWord { word: word.to_owned(), within });
    assert_eq!(header(&words), "2\nso\t-\t-\nwell\t0.5\t2\n");
    let expected = AlignedWord { start_secs: 0.5, end_secs: 0.75, confidence: 1.0 };
    assert_eq!(times("0.50\t0.75\t1.00").unwrap(), Some(expected));
    assert!(times("-").unwrap().is_none() && times("0.5\tx").is_err());
}

#[test]
fn missing_interpreter_is_reported_with_the_remedy() {
    let error = Aligner::version(Path::new("/nowhere/python")).unwrap_err().to_string();
    assert!(error.contains("/nowhere/python") && error.contains("pocketsphinx==5.1.1"), "{error}");
}
