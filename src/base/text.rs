//! Formatting of counts, lists, numbers and durations for readers, and the two forms of accented letters.

use unicode_normalization_alignments::UnicodeNormalization as _;

/// Count with its regular noun: `1 video`, `2 videos`, `2 entries`, `2 processes`.
pub fn counted(n: usize, noun: &str) -> String {
    match noun.strip_suffix('y').filter(|stem| !stem.ends_with(['a', 'e', 'o', 'u'])) {
        _ if n == 1 => format!("1 {noun}"),
        // The only noun in which "ch" is a k.
        None if noun == "epoch" => format!("{n} epochs"),
        Some(stem) => format!("{n} {stem}ies"),
        None if ["s", "x", "ch", "sh"].iter().any(|end| noun.ends_with(end)) => format!("{n} {noun}es"),
        None => format!("{n} {noun}s"),
    }
}

/// The first three of `names`, and the number of the others: `a, b, c and 2 others`.
pub fn first_three(names: &[String]) -> String {
    let first = names[..names.len().min(3)].join(", ");
    let n_others = names.len().saturating_sub(3);
    if n_others == 0 { first } else { format!("{first} and {}", counted(n_others, "other")) }
}

/// Text in Unicode normalisation form C, in which accented letters are single characters. File names are compared in
/// this form, since some systems write form D.
pub fn composed(text: &str) -> String {
    text.chars().nfc().map(|(letter, _)| letter).collect()
}

/// Text in Unicode normalisation form D, in which accents are characters of their own.
pub fn decomposed(text: &str) -> String {
    text.chars().nfd().map(|(letter, _)| letter).collect()
}

/// Duration in whole seconds, with two units from a minute on: `59 s`, `1 min 01 s`, `2 h 03 min`.
pub fn duration(secs: f64) -> String {
    match secs.round() as u64 {
        secs if secs < 60 => format!("{secs} s"),
        secs if secs < 3600 => format!("{} min {:02} s", secs / 60, secs % 60),
        secs => format!("{} h {:02} min", secs / 3600, secs / 60 % 60),
    }
}

/// Duration: `41.2 s`, `12.4 min`, `3.27 h`, like `length` in `page.js`.
pub fn length(secs: f64) -> String {
    // Adding 0 turns -0, the sum of no values, into 0.
    let secs = secs + 0.0;
    match secs.abs() {
        n if n < 120.0 => format!("{secs:.1} s"),
        n if n < 7200.0 => format!("{:.1} min", secs / 60.0),
        _ => format!("{:.2} h", secs / 3600.0),
    }
}

/// Time in a video: `0:04.8`, `1:02:03.0`.
pub fn clock(secs: f64) -> String {
    let tenths = (secs.max(0.0) * 10.0).round() as u64;
    let (hours, minutes, rest) = (tenths / 36_000, tenths / 600 % 60, tenths % 600);
    let seconds = format!("{:02}.{}", rest / 10, rest % 10);
    if hours > 0 { format!("{hours}:{minutes:02}:{seconds}") } else { format!("{minutes}:{seconds}") }
}

/// Number with about three significant digits, at most three decimals and no trailing zeros; `unknown` if not finite.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "unknown".to_owned();
    }
    let digits = match value.abs() {
        n if n >= 100.0 => 0,
        n if n >= 10.0 => 1,
        n if n >= 1.0 => 2,
        _ => 3,
    };
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Number with its unit, which may be empty.
pub fn with_unit(value: f64, unit: &str) -> String {
    format!("{} {unit}", number(value)).trim_end().to_owned()
}

/// Share of `part` in `total` in percent; a dash if `total` is not positive.
pub fn percent(part: f64, total: f64) -> String {
    if total > 0.0 { format!("{:.1} %", 100.0 * part / total + 0.0) } else { "\u{2013}".to_owned() }
}

/// Text with the markup characters of HTML and XML replaced by entities.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\0' => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}
