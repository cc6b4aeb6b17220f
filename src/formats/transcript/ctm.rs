//! CTM of NIST's scoring tools and of Kaldi: recording, channel, start, duration, word and, where it is known, confidence.

use super::word::{self, Word};
use anyhow::{Context, Result, ensure};
use std::collections::BTreeSet;

/// The words of the recording `name`, or of the only one there is.
///
/// # Errors
/// The line that is no row; several recordings, none of which has the name.
pub fn read(text: &str, name: &str) -> Result<Vec<Word>> {
    let rows = text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty() && !line.starts_with(";;"));
    let recordings: BTreeSet<&str> =
        rows.clone().filter_map(|(line, _)| line.split_whitespace().next()).take(1 << 20).collect();
    ensure!(
        recordings.len() <= 1 || recordings.contains(name),
        "it holds {} recordings ({}, ...), none of which is called {name}",
        recordings.len(),
        recordings.first().copied().unwrap_or_default()
    );
    let mut words = Vec::new();
    for (line, n) in rows {
        let parts: Vec<&str> = line.split_whitespace().collect();
        let number = |at: usize| parts.get(at).and_then(|part| part.parse::<f64>().ok());
        let (Some(start), Some(secs), Some(said)) = (number(2), number(3), parts.get(4)) else {
            anyhow::bail!("line {n}: expected recording, channel, start, duration and word, found `{line}`");
        };
        if recordings.len() == 1 || parts[0] == name {
            word::push(&mut words, said, (start, start + secs), number(5)).with_context(|| format!("line {n}"))?;
        }
    }
    Ok(words)
}
