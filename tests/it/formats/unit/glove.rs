//! Unit tests of `orator_formats::word_vectors::glove`.

use orator_formats::word_vectors::glove::convert;

fn error_of(text: &[u8]) -> String {
    let dir = tempfile::tempdir().unwrap();
    format!("{:#}", convert(text, &dir.path().join("w")).unwrap_err())
}

#[test]
fn invalid_dimensions_and_truncation_are_errors_with_the_line() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("w");
    assert_eq!(convert(&b"2 3\nthe 1 2 3 \n. . . 4 5 6\n"[..], &path).unwrap(), 2);
    assert!(error_of(b"the 1 2 3\nso 1 2\n").contains("line 2: expected a word and 3 numbers"));
    assert!(error_of(b"the 1 2 3\nso 1 2 3 4\n").contains("line 2: `so` has 4 numbers, expected 3"));
    assert!(error_of(b"the 1 2 3\nso 1 2 x\n").contains("line 2: `x` is not a number"));
    assert!(error_of(b"the 1 2 3\nso 1 2 nan\n").contains("not finite"));
    assert!(error_of(b"the 1 2 3\nso 1 2 3").contains("line 2 has no line end"));
    assert!(error_of(b"3 2\nthe 1 2\nso 1 2\n").contains("states 3 words, but it has 2"));
    assert!(error_of(b"").contains("empty") && error_of(b"the\n").contains("1 to 10000"));
    assert!(error_of(b"\xff\xfe\n").contains("expected UTF-8 text"));
}
