//! Channel values of a BVH file, one line per frame. Programs that count frames from 0 state one frame too many or too
//! few, and an interrupted recording ends within a line.

use super::words::{Words, number};
use anyhow::{Result, bail, ensure};
use orator_base::text::counted;

/// Reads the values of all complete frames [frames * channels]; line `frames_line` declares `n_declared` frames. If
/// their number is one more or less, the lines count, and a note says so. Frames may span several lines if their
/// number is as declared.
///
/// # Errors
///
/// A word that is not a number; a line that is not one frame; more than one frame more or less than declared.
pub(super) fn read(
    words: &mut Words,
    (n_declared, frames_line): (usize, usize),
    n_channels: usize,
    notes: &mut Vec<String>,
) -> Result<Vec<f64>> {
    let mut values: Vec<f64> = Vec::new();
    // Number and number of values of the last line, and of the first line before it that is not one frame.
    let mut last: Option<(usize, usize)> = None;
    let mut uneven: Option<(usize, usize)> = None;
    // A word that is not a number is an error unless it is the last one of the file, which may be cut off.
    let mut cut_off = None;
    while let Some(line_words) = words.next_line() {
        uneven = uneven.or(last.filter(|&(_, n)| n != n_channels));
        let n_before = values.len();
        for word in line_words {
            if let Some((line, error)) = cut_off.take() {
                words.line = line;
                return Err(error);
            }
            match number(word) {
                Ok(value) => values.push(value),
                Err(error) => cut_off = Some((words.line, error)),
            }
        }
        last = Some((words.line, values.len() - n_before));
    }
    let is_cut_off = cut_off.is_some();
    if let Some((_, error)) = cut_off.filter(|_| last.is_none_or(|(_, n)| n >= n_channels)) {
        return Err(error);
    }
    if values.len() == n_declared * n_channels && !is_cut_off {
        return Ok(values);
    }
    ensure!(n_channels > 0, "{} without channels", counted(values.len(), "value"));
    let expected = format!("expected {} (one frame)", counted(n_channels, "value"));
    if let Some((line, n)) = uneven {
        words.line = line;
        bail!("{}, {expected}", counted(n, "value"));
    }
    if let Some((line, n)) = last.filter(|&(_, n)| n != n_channels) {
        ensure!(n < n_channels, "{}, {expected}", counted(n, "value"));
        values.truncate(values.len() - n);
        notes.push(format!("line {line} is incomplete ({n} of {n_channels} values): not read"));
    }
    let n_frames = values.len() / n_channels;
    ensure!(
        n_frames > 0 && n_frames.abs_diff(n_declared) <= 1,
        "the file has {}, line {frames_line} states {n_declared}: expected one line of {} for each",
        counted(n_frames, "frame"),
        counted(n_channels, "value")
    );
    if n_frames != n_declared {
        notes.push(format!(
            "line {frames_line} states {}, the file has {n_frames}: all complete frames are read",
            counted(n_declared, "frame")
        ));
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values or the error message with its line number, and notes, for three channels.
    fn read_lines(text: &str, n_declared: usize) -> (Result<Vec<f64>, String>, Vec<String>) {
        let (mut words, mut notes) = (Words::new(text), Vec::new());
        let values = read(&mut words, (n_declared, 7), 3, &mut notes);
        (values.map_err(|error| format!("line {}: {error}", words.line)), notes)
    }

    #[test]
    fn one_frame_more_or_less_than_declared_is_read_and_noted() {
        let text = "1 2 3\n4 5 6\n\n7 8 9\n";
        for (n_declared, n_notes) in [(2, 1), (3, 0), (4, 1)] {
            let (values, notes) = read_lines(text, n_declared);
            assert_eq!((values.unwrap().len(), notes.len()), (9, n_notes), "{n_declared}");
        }
        assert_eq!(read_lines(text, 2).1, ["line 7 states 2 frames, the file has 3: all complete frames are read"]);
        for n_declared in [0, 1, 5] {
            let message = read_lines(text, n_declared).0.unwrap_err();
            assert!(message.contains(&format!("the file has 3 frames, line 7 states {n_declared}")), "{message}");
        }
    }

    #[test]
    fn an_incomplete_last_line_is_not_a_frame() {
        for (text, n_declared, n_notes) in
            [("1 2 3\n4 5 6\n7 8", 3, 2), ("1 2 3\n4 5 6\n7 8\n", 2, 1), ("1 2 3\n4 5 6\n7 8 -", 3, 2)]
        {
            let (values, notes) = read_lines(text, n_declared);
            assert_eq!(values.unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
            assert_eq!(notes[0], "line 3 is incomplete (2 of 3 values): not read");
            assert_eq!(notes.len(), n_notes);
        }
    }

    #[test]
    fn uneven_lines_count_only_in_total() {
        assert_eq!(read_lines("1 2\n3 4 5\n6\n", 2).0.unwrap().len(), 6);
        for (text, expected) in [
            ("1 2 3\n4 5\n6 7 8\n", "line 2: 2 values, expected 3 values (one frame)"),
            ("1 2 3\n4 5 6 7\n", "line 2: 4 values, expected 3 values"),
            ("1 2 3\n4 x 6\n7 8 9\n", "line 2: found `x`, expected a number"),
            ("x", "the file has 0 frames, line 7 states 2"),
            ("1 2 3\n4 5 6 x\n", "line 2: found `x`, expected a number"),
        ] {
            let message = read_lines(text, 2).0.unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
