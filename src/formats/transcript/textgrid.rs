//! Praat TextGrid, in the long and the short text format: the words of the speaker's tier.

use super::tiers;
use super::word::{self, Word};
use anyhow::{Context, Result};

/// Beginnings of the lines of the long format that follow a label.
const KEYS: [&str; 6] = ["xmin =", "intervals [", "item [", "points [", "number =", "time ="];

/// The non-empty intervals of the tier of `speaker` (`tiers::words_of`).
///
/// # Errors
///
/// No tier of words, or none of the speaker; a label without end; an interval without two valid times.
pub fn read(text: &str, speaker: &str) -> Result<Vec<Word>> {
    let values = values(text)?;
    let mut all = Vec::new();
    let mut at = 0;
    while at < values.len() {
        let is_tier = matches!(&values[at], TextGridValue::Text(kind) if kind == "IntervalTier");
        at += 1;
        if is_tier {
            all.push(tier(&values, &mut at)?);
        }
    }
    tiers::words_of(all, speaker)
}

/// A number or quoted text; both formats have the same sequence of values. Labels such as `xmin =` and `[1]` are not
/// values.
enum TextGridValue {
    Number(f64),
    Text(String),
}

/// Numbers, and the text of each line from its first to its last quote. A text ends with an unpaired quote, as quotes
/// in it are doubled, and may have several lines.
fn values(text: &str) -> Result<Vec<TextGridValue>> {
    let mut values = Vec::new();
    let mut lines = text.lines().map(str::trim).zip(1..).peekable();
    while let Some((line, n)) = lines.next() {
        let (before, quoted) = line.split_once('"').map_or((line, None), |(before, rest)| (before, Some(rest)));
        let numbers = before.split(|c: char| c == '=' || c.is_whitespace()).filter_map(|word| word.parse::<f64>().ok());
        values.extend(numbers.map(TextGridValue::Number));
        let Some(quoted) = quoted else { continue };
        let (mut label, mut n_quotes) = (quoted.to_owned(), quoted.matches('"').count());
        while n_quotes.is_multiple_of(2)
            && let Some((next, _)) = lines.next_if(|(next, _)| !KEYS.iter().any(|key| next.starts_with(key)))
        {
            n_quotes += next.matches('"').count();
            label.push('\n');
            label.push_str(next);
        }
        let end = label.rfind('"').with_context(|| format!("line {n}: the label has no closing quote"))?;
        values.push(TextGridValue::Text(label[..end].replace("\"\"", "\"")));
    }
    Ok(values)
}

/// Name and intervals of a tier. The values are its name, start, end and number of intervals, then two times and a
/// text per interval.
fn tier(values: &[TextGridValue], at: &mut usize) -> Result<(String, Vec<Word>)> {
    let mut next = || {
        *at += 1;
        values.get(*at - 1).context("the file ends in the middle of a tier")
    };
    let name = match next()? {
        TextGridValue::Text(name) => name.clone(),
        TextGridValue::Number(_) => anyhow::bail!("a tier has no name"),
    };
    let mut number = |what: &str| match next()? {
        TextGridValue::Number(number) => Ok(*number),
        TextGridValue::Text(text) => Err(anyhow::anyhow!("tier {name}: expected {what}, found `{text}`")),
    };
    let n_intervals = (number("its start")?, number("its end")?, number("the number of intervals")?).2;
    let mut words = Vec::new();
    for n in 1..=n_intervals as u64 {
        let interval = (next()?, next()?, next()?);
        let (TextGridValue::Number(start), TextGridValue::Number(end), TextGridValue::Text(word)) = interval else {
            anyhow::bail!("tier {name}: interval {n}: expected two times and a text");
        };
        word::push(&mut words, word, (*start, *end), None).with_context(|| format!("tier {name}: interval {n}"))?;
    }
    Ok((name, words))
}
