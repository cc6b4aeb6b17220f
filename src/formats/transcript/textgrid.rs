//! Praat TextGrid, in the long and the short text format: the words of its word tier.

use super::word::{self, Word};
use anyhow::{Context, Result, ensure};

/// The non-empty intervals of the first tier with `word` in its name, or else of the first interval tier.
///
/// # Errors
///
/// No interval tier; an interval without two valid times.
pub fn read(text: &str) -> Result<Vec<Word>> {
    let values = values(text);
    let mut tiers = Vec::new();
    let mut at = 0;
    while at < values.len() {
        let is_tier = matches!(&values[at], TextGridValue::Text(kind) if kind == "IntervalTier");
        at += 1;
        if is_tier {
            tiers.push(tier(&values, &mut at)?);
        }
    }
    let word_tier = tiers.iter().position(|(name, _)| name.to_lowercase().contains("word")).unwrap_or(0);
    ensure!(!tiers.is_empty(), "the file has no interval tier");
    Ok(tiers.swap_remove(word_tier).1)
}

/// A number or quoted text; both formats have the same sequence of values. Labels such as `xmin =` and `[1]` are not
/// values.
enum TextGridValue {
    Number(f64),
    Text(String),
}

fn values(text: &str) -> Vec<TextGridValue> {
    let mut values = Vec::new();
    for line in text.lines().map(str::trim) {
        if let (Some(first), Some(last)) = (line.find('"'), line.rfind('"'))
            && first < last
        {
            values.push(TextGridValue::Text(line[first + 1..last].replace("\"\"", "\"")));
        } else if let Some(number) = line.rsplit(['=', ' ']).find_map(|word| word.parse::<f64>().ok()) {
            values.push(TextGridValue::Number(number));
        }
    }
    values
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

#[cfg(test)]
mod tests {
    use super::*;

    const LONG: &str = "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\nxmin = 0\nxmax = 2\ntiers? <exists>\n\
        size = 2\nitem []:\n    item [1]:\n        class = \"IntervalTier\"\n        name = \"phones\"\n        xmin = 0\n\
        xmax = 2\n        intervals: size = 1\n        intervals [1]:\n            xmin = 0\n            xmax = 2\n\
        text = \"s\"\n    item [2]:\n        class = \"IntervalTier\"\n        name = \"words\"\n        xmin = 0\n\
        xmax = 2\n        intervals: size = 2\n        intervals [1]:\n            xmin = 0\n            xmax = 0.5\n\
        text = \"\"\n        intervals [2]:\n            xmin = 0.5\n            xmax = 2\n            text = \"so\"\n";
    const SHORT: &str = "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\n0\n2\n<exists>\n1\n\"IntervalTier\"\n\
        \"words\"\n0\n2\n2\n0\n0.5\n\"\"\n0.5\n2\n\"so\"\n";

    #[test]
    fn both_formats_yield_the_words() {
        for text in [LONG, SHORT] {
            let words = read(text).unwrap();
            let found: Vec<_> = words.iter().map(|word| (word.word.as_str(), word.start_secs, word.end_secs)).collect();
            assert_eq!(found, [("so", 0.5, 2.0)]);
        }
        assert!(read("File type = \"ooTextFile\"\n").is_err());
        for end in 0..SHORT.len() {
            let _ = read(&SHORT[..end]);
        }
    }
}
