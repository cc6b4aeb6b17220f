//! Subtitles in SubRip (`.srt`) and WebVTT (`.vtt`) format: the words of a cue share its time, except for words with
//! their own times. Rolling captions, whose cues repeat the lines before the new one, give each word once.

use super::word::{self, Word};
use anyhow::{Context, Result, bail, ensure};

/// Maximum number of lines that a rolling cue repeats.
const MAX_REPEATED: usize = 8;

/// A cue, without its blank lines.
struct SubtitleCue<'a> {
    /// Line number of its times.
    n: usize,
    start_secs: f64,
    end_secs: f64,
    lines: Vec<&'a str>,
    /// The lines without markup.
    shown: Vec<String>,
}

/// The words of all cues, in file order.
///
/// # Errors
///
/// The line of an invalid time; text without any cue.
pub fn read(text: &str) -> Result<Vec<Word>> {
    let cues = cues(text)?;
    ensure!(
        !cues.is_empty() || text.trim().is_empty() || text.starts_with("WEBVTT"),
        "no cues: expected lines such as `00:00:01,000 --> 00:00:02,000`"
    );
    let is_rolling = text.split('<').skip(1).any(|part| inline_time(part).is_some()) || is_rolling(&cues);
    let mut words = Vec::new();
    let mut previous: &[String] = &[];
    for cue in &cues {
        let n_repeated = if is_rolling { n_repeated(previous, &cue.shown) } else { 0 };
        push_cue(&mut words, &cue.lines[n_repeated..].join(" "), cue.start_secs, cue.end_secs)
            .with_context(|| format!("line {}", cue.n))?;
        previous = &cue.shown;
    }
    Ok(words)
}

fn cues(text: &str) -> Result<Vec<SubtitleCue<'_>>> {
    let all: Vec<&str> = text.lines().collect();
    let (mut cues, mut at) = (Vec::new(), 0);
    while at < all.len() {
        at += 1;
        let (line, n) = (all[at - 1], at);
        let Some((start, rest)) = line.split_once("-->") else { continue };
        let end = rest.split_whitespace().next().unwrap_or_default();
        let [start, end] = [start.trim(), end].map(|time| seconds(time).with_context(|| format!("line {n}")));
        let (start_secs, end_secs) = (start?, end?);
        ensure!(end_secs >= start_secs, "line {n}: the cue ends before it starts");
        let mut lines = Vec::new();
        while at < all.len() && !all[at].contains("-->") {
            if !all[at].trim().is_empty() {
                lines.push(all[at].trim());
                at += 1;
            } else if let Some(next) = continuation(&all, at, lines.is_empty()) {
                at = next;
            } else {
                break;
            }
        }
        let shown = lines.iter().map(|line| plain(line)).collect();
        cues.push(SubtitleCue { n, start_secs, end_secs, lines, shown });
    }
    Ok(cues)
}

/// Next line of the cue in which line `at` is blank; `None` if the cue ends there. A line with spaces, and an empty line
/// before the first text, are part of a cue unless another block follows.
fn continuation(lines: &[&str], at: usize, is_first: bool) -> Option<usize> {
    if lines[at].is_empty() && !is_first {
        return None;
    }
    let next = at + lines[at..].iter().position(|line| !line.trim().is_empty())?;
    let has_times = lines[next..].iter().take(2).any(|line| line.contains("-->"));
    let is_comment = ["NOTE", "STYLE", "REGION"].iter().any(|kind| lines[next].starts_with(kind));
    (!has_times && !is_comment).then_some(next)
}

/// Number of lines at the start of a cue that are the last ones of the `previous` cue.
fn n_repeated(previous: &[String], shown: &[String]) -> usize {
    let most = previous.len().min(shown.len()).min(MAX_REPEATED);
    (1..=most).rev().find(|&n| previous[previous.len() - n..] == shown[..n]).unwrap_or(0)
}

/// Whether most cues repeat lines of the cue before, and some of these add new ones.
fn is_rolling(cues: &[SubtitleCue]) -> bool {
    let repeated = cues.windows(2).map(|pair| (n_repeated(&pair[0].shown, &pair[1].shown), pair[1].shown.len()));
    let n_repeating = repeated.clone().filter(|(n, _)| *n > 0).count();
    let adds_lines = repeated.clone().any(|(n, n_lines)| n > 0 && n < n_lines);
    adds_lines && 2 * n_repeating >= repeated.len()
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
    let is_time = time.contains(':') && time.bytes().all(|byte| byte.is_ascii_digit() || b":.,".contains(&byte));
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
