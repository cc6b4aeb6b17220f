//! Matching of recognised words with the words of a text, by their letters.

use crate::align::words::WITHOUT_SPACES;
use ndarray::Array2;
use orator_base::text::decomposed;

/// Marks that divide a word into units.
const DIVIDERS: [char; 4] = ['-', '\u{2013}', '\u{2014}', '/'];
/// Similarity from which two units match.
const MIN_SIMILARITY: f32 = 0.6;
/// Score of a matching letter, of at most `MAX_LETTERS` a unit.
const LETTER: f32 = 0.25;
const MAX_LETTERS: usize = 8;
/// Costs of two units that differ, and of a recognised unit that is not in the text.
const DIFFERENT: f32 = 0.2;
const INSERTED: f32 = 0.1;
/// Costs of text that is not recognised: of any, and of each unit.
const SKIP: f32 = 0.6;
const SKIPPED: f32 = 0.05;

/// Letters and digits of a word or of a part of it; in languages without spaces, of a character.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MatchUnit {
    /// Number of the word.
    pub(crate) word: usize,
    /// Lower case, without accents.
    letters: Vec<char>,
}

/// The units of words.
pub(crate) fn units_of<'a>(words: impl Iterator<Item = &'a str>, language: &str) -> Vec<MatchUnit> {
    let divides_all = WITHOUT_SPACES.contains(&language);
    let mut units = Vec::new();
    for (word, text) in words.enumerate() {
        for part in text.split(DIVIDERS) {
            let letters: Vec<char> =
                decomposed(&part.to_lowercase()).chars().filter(|letter| letter.is_alphanumeric()).collect();
            let size = if divides_all { 1 } else { letters.len().max(1) };
            units.extend(letters.chunks(size).map(|letters| MatchUnit { word, letters: letters.to_vec() }));
        }
    }
    units
}

/// Pairs of a unit of the text and a recognised unit, in order, that match: the best alignment of all recognised units
/// with the start of the text. Text may be skipped at a cost. `may_match` excludes pairs.
pub(crate) fn match_units(
    text: &[MatchUnit],
    recognised: &[MatchUnit],
    may_match: impl Fn(usize, usize) -> bool,
) -> Vec<(usize, usize)> {
    let size = (recognised.len() + 1, text.len() + 1);
    let mut moves = Array2::from_elem(size, Move::Insert);
    let mut opens = Array2::from_elem(size, false);
    let mut before: Vec<f32> = Vec::new();
    for row in 0..size.0 {
        let (mut scores, mut skip) = (vec![f32::NEG_INFINITY; size.1], f32::NEG_INFINITY);
        for column in 0..size.1 {
            let (mut best, mut step) = match row {
                0 => (if column == 0 { 0.0 } else { f32::NEG_INFINITY }, Move::Insert),
                _ => (before[column] - INSERTED, Move::Insert),
            };
            if row > 0 && column > 0 {
                let (text, recognised) = (&text[column - 1], &recognised[row - 1]);
                let similarity = similarity(&text.letters, &recognised.letters);
                let is_match = similarity >= MIN_SIMILARITY && may_match(column - 1, row - 1);
                let n_letters = text.letters.len().min(MAX_LETTERS) as f32;
                let gain = if is_match { LETTER * n_letters * similarity } else { -DIFFERENT };
                if before[column - 1] + gain > best {
                    (best, step) = (before[column - 1] + gain, if is_match { Move::Match } else { Move::Differ });
                }
            }
            if column > 0 {
                let opened = scores[column - 1] - SKIP;
                opens[(row, column)] = opened >= skip;
                skip = skip.max(opened) - SKIPPED;
                if skip > best {
                    (best, step) = (skip, Move::Skip);
                }
            }
            scores[column] = best;
            moves[(row, column)] = step;
        }
        before = scores;
    }
    let mut column = 0;
    for (nth, &score) in before.iter().enumerate() {
        column = if score > before[column] { nth } else { column };
    }
    let (mut row, mut pairs) = (size.0 - 1, Vec::new());
    while row > 0 || column > 0 {
        match moves[(row, column)] {
            Move::Insert if row > 0 => row -= 1,
            step @ (Move::Match | Move::Differ) => {
                (row, column) = (row - 1, column - 1);
                if let Move::Match = step {
                    pairs.push((column, row));
                }
            }
            // Back to the start of the skipped text.
            _ => {
                while column > 1 && !opens[(row, column)] {
                    column -= 1;
                }
                column = column.saturating_sub(1);
            }
        }
    }
    pairs.reverse();
    pairs
}

/// How the best alignment reaches a pair of positions.
#[derive(Clone, Copy)]
enum Move {
    Match,
    Differ,
    Insert,
    Skip,
}

/// 1 for equal letters, 0 if all differ: the edit distance relative to the longer word.
fn similarity(a: &[char], b: &[char]) -> f32 {
    let longest = a.len().max(b.len()).max(1);
    if a == b {
        return 1.0;
    }
    // The difference of the lengths is the least distance.
    if (a.len().min(b.len()) as f32) < MIN_SIMILARITY * longest as f32 {
        return 0.0;
    }
    let mut distances: Vec<usize> = (0..=b.len()).collect();
    for (row, a) in a.iter().enumerate() {
        let mut diagonal = std::mem::replace(&mut distances[0], row + 1);
        for (column, b) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(a != b);
            diagonal = distances[column + 1];
            distances[column + 1] = replaced.min(diagonal + 1).min(distances[column] + 1);
        }
    }
    1.0 - distances[b.len()] as f32 / longest as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matched(text: &str, recognised: &str, language: &str) -> String {
        let units = |text: &str| units_of(text.split_whitespace(), language);
        let (text, recognised) = (units(text), units(recognised));
        let pairs = match_units(&text, &recognised, |_, _| true);
        let pairs = pairs.iter().map(|&(unit, _)| text[unit].letters.iter().collect::<String>());
        pairs.collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn recognised_words_are_found_in_the_text() {
        assert_eq!(
            matched("Printing, in the only sense", "printing in the only sense", "en"),
            "printing in the only sense"
        );
        assert_eq!(
            matched("well-known Gutenberg's b\u{fc}cher", "Well known Gutenburgs Bucher", "de"),
            "well known gutenbergs bucher"
        );
        assert_eq!(matched("we see 1865 now and then", "we see eighteen sixty five now and", "en"), "we see now and");
        assert_eq!(matched("a b", "", "en"), "");
        assert_eq!(matched("", "a b", "en"), "");
        assert_eq!(
            matched("\u{65e5}\u{672c}\u{8a9e}\u{3002}\u{3067}\u{3059}", "\u{65e5}\u{672c}\u{3067}\u{3059}", "ja")
                .chars()
                .count(),
            7
        );
    }

    #[test]
    fn text_is_skipped_only_for_enough_words() {
        let passage = "four score and seven years ago our fathers brought forth on this continent ";
        let text = format!("{passage}a new nation conceived in liberty and dedicated to the proposition");
        assert_eq!(matched(&text, "a new nation conceived in liberty", "en"), "a new nation conceived in liberty");
        // A single short word is a coincidence.
        assert_eq!(matched(&text, "thank you for to day", "en"), "four");
        assert_eq!(matched(&text, "bonjour madame la vie", "en"), "");
        let units = |text: &str| units_of(text.split_whitespace(), "en");
        assert!(match_units(&units("yes no"), &units("yes no"), |text, _| text == 1) == [(1, 1)]);
    }

    #[test]
    fn similarity_is_relative_to_the_longer_word() {
        let of = |a: &str, b: &str| similarity(&a.chars().collect::<Vec<_>>(), &b.chars().collect::<Vec<_>>());
        assert_eq!(
            (of("abc", "abc"), of("abcd", "abxd"), of("abcd", "bcd"), of("a", "abcdef")),
            (1.0, 0.75, 0.75, 0.0)
        );
        assert_eq!((of("", ""), of("window", "minnow")), (1.0, 1.0 - 2.0 / 6.0));
    }
}
