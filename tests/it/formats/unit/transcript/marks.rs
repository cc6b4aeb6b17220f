//! Tests of `orator_formats::transcript::marks`.

use orator_formats::transcript::marks::{are_spoken, spoken};

#[test]
fn marks_are_not_spoken() {
    let of = |text: &str| spoken(text).join(" ");
    for mark in [
        "[Music]",
        "[soft music playing].",
        "(applause)",
        "(audience laughing)",
        "sp",
        "SIL",
        "spn",
        "<eps>",
        "<unk>",
        "{LG}",
        "{NS}",
        "{SL}",
        "♪ ♪",
        ">>",
        "-",
        "---",
        "– —",
        " ",
    ] {
        assert_eq!(of(mark), "", "{mark}");
    }
    assert_eq!(of("[Music]  so (coughs) well, [loud noise] {NS} now"), "so well, now");
    assert_eq!(of("- Are you? - Well-known, -5 …"), "Are you? Well-known, -5");
    // Text that only resembles a mark.
    let long = "[a b c d e f g h i";
    for words in ["word(s) (as he said) ok", "Sil lay", "[", "a ] b", "3 < 4", "& <", "()", long] {
        assert_eq!(of(words), words);
    }
    assert_eq!(are_spoken(&["so", "[loud", "noise]", "now"]), [true, false, false, true]);
    assert_eq!(spoken(&"[ ".repeat(1 << 20)).len(), 1 << 20);
}
