//! Subtitles, SubRip (`.srt`) and WebVTT (`.vtt`): cues of several words. The words of a cue share its time by their
//! letters, since the formats time no single word.

use super::word::Word;
use anyhow::{Context, Result, bail, ensure};

/// The words of all cues, in their order.
///
/// # Errors
/// The line of a time that cannot be read.
pub fn read(text: &str) -> Result<Vec<Word>> {
    let mut words = Vec::new();
    let mut lines = text.lines().map(str::trim).zip(1..);
    while let Some((line, n)) = lines.next() {
        let Some((start, rest)) = line.split_once("-->") else { continue };
        let end = rest.split_whitespace().next().unwrap_or_default();
        let [start, end] = [start.trim(), end].map(|time| seconds(time).with_context(|| format!("line {n}")));
        let (start, end) = (start?, end?);
        ensure!(end >= start, "line {n}: the cue ends before it begins");
        let cue: Vec<&str> = lines.by_ref().map(|(line, _)| line).take_while(|line| !line.is_empty()).collect();
        spread(&plain(&cue.join(" ")), start, end, &mut words);
    }
    Ok(words)
}

/// Hours, minutes and seconds with `:` between, a decimal comma or point.
fn seconds(time: &str) -> Result<f64> {
    let mut secs = 0.0;
    for part in time.replace(',', ".").splitn(3, ':') {
        match part.parse::<f64>() {
            Ok(number) if (0.0..1e9).contains(&number) => secs = secs * 60.0 + number,
            _ => bail!("`{time}` is no time; expected 00:01:02,345"),
        }
    }
    Ok(secs)
}

/// Text without markup (`<i>`, `{\an8}`).
fn plain(text: &str) -> String {
    let mut depth = 0_usize;
    let shown = text.chars().filter(|letter| match letter {
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
    shown.collect()
}

fn spread(text: &str, start: f64, end: f64, words: &mut Vec<Word>) {
    let n_letters: usize = text.split_whitespace().map(|word| word.chars().count()).sum();
    let secs = (end - start) / n_letters.max(1) as f64;
    let mut at = start;
    for word in text.split_whitespace() {
        let until = at + secs * word.chars().count() as f64;
        words.push(Word { start_secs: at, end_secs: until, word: word.to_owned() });
        at = until;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cues_of_both_formats_become_words() {
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
    }
}
