//! Tests of `orator_formats::transcript::tiers`.

use anyhow::Result;
use orator_formats::transcript::tiers::words_of;
use orator_formats::transcript::word;

/// Words of the chosen tier. Each tier contains its own name.
fn chosen(names: &[&str], speaker: &str) -> Result<String> {
    let tier = |name: &&str| {
        let mut words = Vec::new();
        word::push(&mut words, name, (0.0, 1.0), None).unwrap();
        ((*name).to_owned(), words)
    };
    let words = words_of(names.iter().map(tier).collect(), speaker)?;
    Ok(words.iter().map(|word| word.word.as_str()).collect::<Vec<_>>().join(" "))
}

#[test]
fn the_tier_of_the_speaker_is_chosen_or_asked_for() {
    let of = |names: &[&str], speaker: &str| chosen(names, speaker).unwrap();
    assert_eq!(of(&["phones", "Words", "other"], "anna"), "Words");
    assert_eq!(of(&["Ben Ray - words", "Ben Ray - phones", "Anna - words"], "anna"), "Anna words");
    assert_eq!(of(&["Ben Ray - words", "Anna - words"], "ben-ray"), "Ben Ray words");
    assert_eq!(of(&["word_ben", "word_anna"], "anna"), "word_anna");
    assert_eq!(of(&["Ben", "Anna", "phones"], "Anna"), "Anna");
    assert_eq!(of(&["Ben", "phones"], "anna"), "Ben");
    assert_eq!(of(&["words (old)", "words"], "anna"), "words");
    assert_eq!(of(&["MAU", "ORT-MAU", "KAN-MAU"], "anna"), "ORT-MAU");
    let error = |names: &[&str]| chosen(names, "carl").unwrap_err().to_string();
    let several = error(&["Ben - words", "Anna - words"]);
    assert!(several.contains("`Ben - words`, `Anna - words`") && several.contains("(Ben, Anna)"), "{several}");
    assert!(error(&["Ben", "Anna"]).contains("--speaker") && error(&["Ben"; 1_000]).len() < 2_000);
    assert!(error(&["phones", "Syllables", "MAU"]).contains("`phones`, `Syllables`, `MAU`"));
    assert!(error(&["AH0"]).contains("contain phones") && error(&[]).contains("no interval tier"));
}
