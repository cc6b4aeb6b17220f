//! Marks in transcripts that are not spoken words: sounds (`[Music]`, `(applause)`, musical notes), dashes, pauses (`sp`,
//! `sil`) and the noise and unknown words of aligners (`{LG}`, `<unk>`).

/// Labels of pauses and noise: Penn aligner, Montreal aligner, Kaldi.
const PAUSES: [&str; 4] = ["sp", "sil", "spn", "nsn"];
/// Brackets around a mark of one word; round brackets also enclose a complete label.
const BRACKETS: [(char, char); 3] = [('(', ')'), ('{', '}'), ('<', '>')];
/// Maximum length of a mark in square brackets, in words.
const MAX_WORDS: usize = 8;
const PUNCTUATION: [char; 6] = ['.', ',', '!', '?', ':', ';'];

/// The spoken words of a label, sentence or cue.
pub fn spoken(text: &str) -> Vec<&str> {
    let label = text.trim();
    let is_pause = PAUSES.iter().any(|pause| label == *pause || label == pause.to_uppercase());
    if is_pause || is_enclosed(label, BRACKETS[0]) {
        return Vec::new();
    }
    let tokens: Vec<&str> = label.split_whitespace().collect();
    let mut are_spoken = are_spoken(&tokens).into_iter();
    tokens.into_iter().filter(|_| are_spoken.next().unwrap_or(true)).collect()
}

/// Whether each of the consecutive `tokens` is a spoken word.
pub fn are_spoken(tokens: &[&str]) -> Vec<bool> {
    let mut end_of_mark = 0;
    let is_spoken = |(at, token): (usize, &&str)| {
        if token.starts_with('[') {
            let end = tokens[at..].iter().take(MAX_WORDS).position(|token| bare(token).ends_with(']'));
            end_of_mark = end.map_or(end_of_mark, |n| end_of_mark.max(at + n + 1));
        }
        at >= end_of_mark && !is_mark(token)
    };
    tokens.iter().enumerate().map(is_spoken).collect()
}

fn bare(token: &str) -> &str {
    token.trim_end_matches(PUNCTUATION)
}

fn is_mark(token: &str) -> bool {
    let is_sign = !token.is_empty() && token.chars().all(|c| "♪♫♬>-–—…".contains(c));
    is_sign || BRACKETS.iter().any(|brackets| is_enclosed(bare(token), *brackets))
}

/// Whether the brackets enclose the complete text, which is not empty.
fn is_enclosed(text: &str, (open, close): (char, char)) -> bool {
    let inside = text.strip_prefix(open).and_then(|rest| rest.strip_suffix(close));
    inside.is_some_and(|inside| !inside.is_empty() && !inside.contains([open, close]))
}
