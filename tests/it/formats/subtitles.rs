//! Words and times of subtitles.

use orator_formats::transcript::WordSource;
use orator_formats::transcript::subtitles::read;

#[test]
fn cues_of_both_formats_are_split_into_words() {
    let srt = "1\r\n00:00:01,000 --> 00:00:02,000\r\n<i>so</i> well\r\n\r\n2\r\n01:00:00,5 --> 01:00:01,5\r\nnow\r\n";
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

/// Words with the start and end of their cues.
fn spoken(text: &str) -> Vec<(String, f64, f64)> {
    let words = read(text).unwrap();
    let mut cues: Vec<(String, f64, f64)> = Vec::new();
    for word in words {
        match cues.last_mut().filter(|(_, _, end)| *end == word.start_secs && word.source == WordSource::Shared) {
            Some((text, _, end)) => {
                *text += &format!(" {}", word.word);
                *end = word.end_secs;
            }
            None => cues.push((word.word, word.start_secs, word.end_secs)),
        }
    }
    cues
}

#[test]
fn rolling_captions_give_each_word_once() {
    let srt = "1\n00:00:01,000 --> 00:00:02,000\n[Applause]\nwe have a plan\n\n\
               2\n00:00:02,000 --> 00:00:02,010\nwe have a plan\n \n\n\
               3\n00:00:03,000 --> 00:00:04,000\nwe have a plan\nno no\n\n\
               4\n00:00:04,000 --> 00:00:04,010\nno no\n \n\n\
               5\n00:00:05,000 --> 00:00:06,000\nno no\nno no\n\n\
               6\n00:00:06,000 --> 00:00:06,010\nno no\n \n\n";
    let expected = [("we have a plan", 1.0, 2.0), ("no no", 3.0, 4.0), ("no no", 5.0, 6.0)];
    assert_eq!(spoken(srt), expected.map(|(text, start, end)| (text.to_owned(), start, end)));
    // Lines of normal subtitles may be repeated.
    let cue = |n: usize, text: &str| format!("{n}\n00:00:{n:02},000 --> 00:00:{n:02},500\n{text}\n\n");
    let n_words = |texts: &[&str]| {
        let srt: String = texts.iter().zip(1..).map(|(text, n)| cue(n, text)).collect();
        read(&srt).unwrap().len()
    };
    assert_eq!(n_words(&["yes", "yes", "well", "no", "no"]), 5);
    assert_eq!(n_words(&["a", "b", "b\nc", "d", "e", "f"]), 7);
}

#[test]
fn blank_lines_in_cues_are_no_ends() {
    let vtt = "WEBVTT\nKind: captions\n\n00:00:01.000 --> 00:00:03.000 align:start\n \n\
               so<00:00:01.500><c> well</c>\n\n00:00:03.000 --> 00:00:03.010\nso well\n \n\n\
               00:00:03.010 --> 00:00:05.000\nso well\nnow<00:00:04.000><c> then</c>\n";
    let found: Vec<_> = read(vtt).unwrap().into_iter().map(|w| (w.word, w.start_secs, w.end_secs)).collect();
    let expected = [("so", 1.0, 1.5), ("well", 1.5, 3.0), ("now", 3.01, 4.0), ("then", 4.0, 5.0)];
    assert_eq!(found, expected.map(|(word, start, end)| (word.to_owned(), start, end)));
    // An empty first line, an empty cue, and a cue of a number.
    let srt = "1\n00:00:01,000 --> 00:00:02,000\n\nso\n\n2\n00:00:02,000 --> 00:00:03,000\n\n\
               3\n00:00:03,000 --> 00:00:04,000\n4\n \n5\n00:00:04,000 --> 00:00:05,000\nnow\n \nthen\n";
    let found: Vec<String> = read(srt).unwrap().into_iter().map(|word| word.word).collect();
    assert_eq!(found, ["so", "4", "now", "then"]);
    // SubRip with times of words.
    let srt = "1\n00:00:01,000 --> 00:00:02,000\nso<00:00:01,500> well\n";
    assert_eq!(read(srt).unwrap()[1].start_secs, 1.5);
}
