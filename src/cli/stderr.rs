//! Lines on standard error.

use std::borrow::Cow;
use std::io::Write;

/// Writes a line on standard error, where that can still be written.
pub fn note(line: &str) {
    let _ = writeln!(std::io::stderr(), "{}", shown(line));
}

/// Text without control characters: words of a damaged file must not command the terminal.
pub fn shown(text: &str) -> Cow<'_, str> {
    let commands = |letter: char| letter.is_control() && !matches!(letter, '\n' | '\t');
    if text.contains(commands) { text.replace(commands, "\u{fffd}").into() } else { text.into() }
}
