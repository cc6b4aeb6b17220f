//! Choice of the tier with the words of a speaker, in TextGrids and in the JSON of aligners.

use super::word::Word;
use anyhow::{Result, ensure};

/// Vowels of ARPAbet, which aligners write with a digit for the stress.
const VOWELS: [&str; 15] = ["AA", "AE", "AH", "AO", "AW", "AY", "EH", "ER", "EY", "IH", "IY", "OW", "OY", "UH", "UW"];

/// Maximum number of tiers that a message names.
const MAX_NAMED: usize = 40;

/// Words of the tier of `speaker`, given all interval tiers with their names. Tiers with `word` in their name (`ORT` of
/// WebMAUS) take precedence; if there are none, tiers of phones are excluded.
pub fn words_of(mut tiers: Vec<(String, Vec<Word>)>, speaker: &str) -> Result<Vec<Word>> {
    ensure!(!tiers.is_empty(), "the file has no interval tier");
    let all = names(&tiers);
    if tiers.iter().any(|(name, _)| is_of_words(name)) {
        tiers.retain(|(name, _)| is_of_words(name));
    } else {
        tiers.retain(|(name, words)| !is_of_phones(name, words));
        ensure!(!tiers.is_empty(), "the tiers ({all}) contain phones: expected a tier named `words`");
    }
    let named = |owner_name: &str| tiers.iter().position(|(name, _)| key(owner(name)) == key(owner_name));
    let chosen = if tiers.len() == 1 { Some(0) } else { named(speaker).or_else(|| named("")) };
    let Some(chosen) = chosen else {
        anyhow::bail!(
            "the words of the speaker may be in any of the tiers {}: give the speaker the name of one ({}) with \
             --speaker or `name` under [[speaker]], rename one to `words`, or delete the others",
            names(&tiers),
            tiers.iter().take(MAX_NAMED).map(|(name, _)| owner(name)).collect::<Vec<_>>().join(", ")
        )
    };
    Ok(tiers.swap_remove(chosen).1)
}

fn names(tiers: &[(String, Vec<Word>)]) -> String {
    tiers.iter().take(MAX_NAMED).map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// Letters and digits in lower case.
fn key(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// Name of the speaker in the name of a tier, such as `Host` of `Host - words`; may be empty.
fn owner(name: &str) -> &str {
    let lower = name.to_ascii_lowercase();
    let without = |kind: &&str| match lower.strip_suffix(*kind) {
        Some(rest) => Some(&name[..rest.len()]),
        None => lower.starts_with(*kind).then(|| &name[kind.len()..]),
    };
    let rest = ["words", "word"].iter().find_map(without).unwrap_or(name);
    rest.trim_matches(|c: char| !c.is_alphanumeric())
}

fn is_of_words(name: &str) -> bool {
    name.to_lowercase().contains("word") || ["ort", "ortmau"].contains(&key(name).as_str())
}

fn is_of_phones(name: &str, words: &[Word]) -> bool {
    let lower = name.to_lowercase();
    let is_stressed_vowel =
        |word: &Word| word.word.strip_suffix(['0', '1', '2']).is_some_and(|vowel| VOWELS.contains(&vowel));
    ["phon", "syll"].iter().any(|kind| lower.contains(kind))
        || ["mau", "kanmau"].contains(&key(name).as_str())
        || words.iter().any(is_stressed_vowel)
}
