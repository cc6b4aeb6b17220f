//! Words of a BVH file with their line numbers. Comments, lines that begin with `#` or `//`, are skipped.

use anyhow::{Context, Result, anyhow, ensure};
use std::iter::Enumerate;
use std::str::{Lines, SplitAsciiWhitespace};

/// Words that have not been read yet.
pub(super) struct Words<'a> {
    lines: Enumerate<Lines<'a>>,
    rest_of_line: SplitAsciiWhitespace<'a>,
    /// Number of the line of the last word, from 1.
    pub(super) line: usize,
}

impl<'a> Words<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { lines: text.lines().enumerate(), rest_of_line: "".split_ascii_whitespace(), line: 1 }
    }

    /// Words of the current line that are left, or those of the next line that has any; `None` at the end.
    pub(super) fn next_line(&mut self) -> Option<SplitAsciiWhitespace<'a>> {
        loop {
            let words = std::mem::replace(&mut self.rest_of_line, "".split_ascii_whitespace());
            if words.clone().next().is_some() {
                return Some(words);
            }
            let (idx, line) = self.lines.find(|(_, line)| !is_blank_or_comment(line))?;
            self.line = idx + 1;
            self.rest_of_line = line.split_ascii_whitespace();
        }
    }

    pub(super) fn next(&mut self, what: &str) -> Result<&'a str> {
        let mut words = self.next_line().with_context(|| format!("unexpected end of file: expected {what}"))?;
        let word = words.next().unwrap_or_default();
        self.rest_of_line = words;
        Ok(word)
    }

    pub(super) fn expect(&mut self, word: &str) -> Result<()> {
        let found = self.next(&format!("`{word}`"))?;
        ensure!(found.eq_ignore_ascii_case(word), "found `{found}`, expected `{word}`");
        Ok(())
    }

    pub(super) fn number(&mut self) -> Result<f64> {
        number(self.next("a number")?)
    }
}

fn is_blank_or_comment(line: &str) -> bool {
    let line = line.trim_ascii_start();
    line.is_empty() || line.starts_with('#') || line.starts_with("//")
}

pub(super) fn number(word: &str) -> Result<f64> {
    word.parse().map_err(|_| anyhow!("found `{word}`, expected a number"))
}
