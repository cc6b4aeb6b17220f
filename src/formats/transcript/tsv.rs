//! Tables with tabs, a row a word or a sentence: start, end and text in seconds (GENEA 2022 and 2023), or in
//! milliseconds under the header `start end text` (Whisper).

use super::word::{self, Word};
use anyhow::{Context, Result, bail};

/// The words of all rows.
///
/// # Errors
/// The line of a row without times.
pub fn read(text: &str) -> Result<Vec<Word>> {
    let mut words = Vec::new();
    let mut per_sec = 1.0;
    for (line, n) in text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty()) {
        let mut parts = line.splitn(3, '\t').map(str::trim);
        let (Some(start), Some(end), Some(said)) = (parts.next(), parts.next(), parts.next()) else {
            bail!("line {n}: expected start, end and word with tabs between, found `{line}`");
        };
        match (start.parse::<f64>(), end.parse::<f64>()) {
            (Ok(start), Ok(end)) => word::push(&mut words, said, (start / per_sec, end / per_sec), None)
                .with_context(|| format!("line {n}"))?,
            // Header line.
            _ if n == 1 => per_sec = if (start, end, said) == ("start", "end", "text") { 1000.0 } else { 1.0 },
            _ => bail!("line {n}: `{start}` and `{end}` are no seconds"),
        }
    }
    Ok(words)
}
