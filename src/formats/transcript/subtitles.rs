//! Subtitles in SubRip (`.srt`) and WebVTT (`.vtt`) format: the words of a cue share its time, except for words with
//! their own times in WebVTT.

use super::word::{self, Word};
use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeSet;

/// The words of all cues, in file order.
///
/// # Errors
///
/// The line of an invalid time; text without any cue.
pub fn read(text: &str) -> Result<Vec<Word>> {
    let mut words = Vec::new();
    let mut lines = text.lines().map(str::trim).zip(1..).peekable();
    let mut n_cues = 0;
    // With timed words (rolling captions), a cue repeats the previous line.
    let is_rolling = text.split('<').skip(1).any(|part| inline_time(part).is_some());
    let mut previous: BTreeSet<String> = BTreeSet::new();
    while let Some((line, n)) = lines.next() {
        let Some((start, rest)) = line.split_once("-->") else { continue };
        let end = rest.split_whitespace().next().unwrap_or_default();
        let [start, end] = [start.trim(), end].map(|time| seconds(time).with_context(|| format!("line {n}")));
        let (start, end) = (start?, end?);
        ensure!(end >= start, "line {n}: the cue ends before it starts");
        n_cues += 1;
        let mut cue: Vec<&str> = Vec::new();
        while let Some((line, _)) = lines.next_if(|(line, _)| !line.is_empty() && !line.contains("-->")) {
            cue.push(line);
        }
        let shown: Vec<String> = cue.iter().map(|line| plain(line)).collect();
        let is_new = |shown: &String| !is_rolling || !previous.contains(shown);
        let new_lines: Vec<&str> =
            cue.iter().zip(&shown).filter(|(_, shown)| is_new(shown)).map(|(line, _)| *line).collect();
        push_cue(&mut words, &new_lines.join(" "), start, end).with_context(|| format!("line {n}"))?;
        previous = shown.into_iter().collect();
    }
    ensure!(
        n_cues > 0 || text.trim().is_empty() || text.starts_with("WEBVTT"),
        "no cues: expected lines such as `00:00:01,000 --> 00:00:02,000`"
    );
    Ok(words)
}

/// Adds the words of a cue, split at the inline times.
fn push_cue(words: &mut Vec<Word>, text: &str, start: f64, end: f64) -> Result<()> {
    let (mut at, mut piece) = (start, String::new());
    for (nth, part) in text.split('<').enumerate() {
        match inline_time(part).filter(|_| nth > 0) {
            Some((time, rest)) => {
                let time = time.clamp(at, end);
                word::push(words, &plain(&piece), (at, time), None)?;
                (at, piece) = (time, rest.to_owned());
            }
            None if nth > 0 => {
                piece.push('<');
                piece.push_str(part);
            }
            None => part.clone_into(&mut piece),
        }
    }
    word::push(words, &plain(&piece), (at, end), None)
}

/// Time of a tag `00:00:01.500>`, and the text after it.
fn inline_time(part: &str) -> Option<(f64, &str)> {
    let (time, rest) = part.split_once('>')?;
    let is_time = time.contains(':') && time.bytes().all(|byte| byte.is_ascii_digit() || b":.".contains(&byte));
    if !is_time {
        return None;
    }
    Some((seconds(time).ok()?, rest))
}

/// Parses hours, minutes and seconds separated by `:`, with a decimal comma or point.
fn seconds(time: &str) -> Result<f64> {
    let mut secs = 0.0;
    for part in time.replace(',', ".").splitn(3, ':') {
        match part.parse::<f64>() {
            Ok(number) if (0.0..1e9).contains(&number) => secs = secs * 60.0 + number,
            _ => bail!("invalid time `{time}`: expected the form 00:01:02,345"),
        }
    }
    Ok(secs)
}

/// Text without markup (`<i>`, `{\an8}`), with WebVTT entities decoded.
fn plain(text: &str) -> String {
    let mut depth = 0_usize;
    let shown = text.chars().filter(|character| match character {
        '<' | '{' => {
            depth += 1;
            false
        }
        '>' | '}' => {
            depth = depth.saturating_sub(1);
            false
        }
        _ => depth == 0,
    });
    let shown: String = shown.collect();
    shown.replace("&nbsp;", " ").replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transcript::WordSource;

    #[test]
    fn cues_of_both_formats_are_split_into_words() {
        let srt =
            "1\r\n00:00:01,000 --> 00:00:02,000\r\n<i>so</i> well\r\n\r\n2\r\n01:00:00,5 --> 01:00:01,5\r\nnow\r\n";
        let words = read(srt).unwrap();
        let at: Vec<_> = words.iter().map(|w| (w.word.as_str(), w.start_secs, w.end_secs)).collect();
        assert_eq!(at.len(), 3);
        assert_eq!((at[0].0, at[0].1, at[1].0, at[2]), ("so", 1.0, "well", ("now", 3600.5, 3601.5)));
        assert!((at[0].2 - (1.0 + 2.0 / 6.0)).abs() < 1e-12 && (at[1].2 - 2.0).abs() < 1e-12);
        let vtt = "WEBVTT\n\nNOTE ignored\n\n00:01.000 --> 00:02.000 align:start\nso well\n";
        assert_eq!(read(vtt).unwrap().len(), 2);
        assert!(format!("{:#}", read("x --> 00:01\nso\n").unwrap_err()).contains("line 1"));
        assert!(read("00:02 --> 00:01\nso\n").is_err());
        assert!(read("so well\n").is_err() && read("\n").unwrap().is_empty());
    }

    #[test]
    fn parsing_takes_linear_time() {
        let cue = |text: &str| format!("WEBVTT\n\n00:01.000 --> 00:02.000\n{text}\n\n");
        let lines: String = (0..100_000).map(|n| format!("line{n:06}<00:01.500>\n")).collect();
        for text in [cue(&"<".repeat(4 << 20)), cue(&"a<".repeat(2 << 20)), cue(&lines) + &cue(&lines)] {
            let started = std::time::Instant::now();
            read(&text).unwrap();
            // Quadratic time would take minutes.
            assert!(started.elapsed().as_secs() < 20, "{} bytes took {:?}", text.len(), started.elapsed());
        }
    }

    #[test]
    fn webvtt_inline_times_are_used_once_per_word() {
        let vtt = "WEBVTT\n\n00:00:01.000 --> 00:00:03.000\nso<00:00:01.500><c> well</c><00:00:02.000><c> &amp;</c>\n\n\
                   00:00:03.000 --> 00:00:03.010\nso well &amp;\n\n\
                   00:00:03.010 --> 00:00:04.000\nso well &amp;\nnow<00:00:03.500><c> then</c>\n";
        let words = read(vtt).unwrap();
        let found: Vec<_> = words.iter().map(|w| (w.word.as_str(), w.start_secs, w.end_secs)).collect();
        let expected = [("so", 1.0, 1.5), ("well", 1.5, 2.0), ("&", 2.0, 3.0), ("now", 3.01, 3.5), ("then", 3.5, 4.0)];
        assert_eq!(found, expected);
        assert!(words.iter().all(|word| word.source == WordSource::Given));
    }
}
