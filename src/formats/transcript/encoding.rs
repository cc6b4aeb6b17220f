//! Decodes text files: UTF-8, or UTF-16 with a byte order mark, as Praat and Windows programs write it.

use anyhow::{Result, bail, ensure};

/// The decoded text without its byte order mark.
///
/// # Errors
///
/// Another encoding; the message names the line of the first invalid byte.
pub fn text_of(bytes: &[u8]) -> Result<String> {
    match bytes {
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] => utf8(rest),
        _ => utf8(bytes),
    }
}

fn utf8(bytes: &[u8]) -> Result<String> {
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            let at = error.valid_up_to();
            let line = bytes[..at].split(|byte| *byte == b'\n').count();
            bail!("line {line}: byte {:#04x} is not valid UTF-8; save the file as UTF-8", bytes[at]);
        }
    };
    if let Some(at) = text.find('\0') {
        let line = 1 + text[..at].matches('\n').count();
        bail!("line {line}: found a zero byte: not text, or UTF-16 without a byte order mark; save the file as UTF-8");
    }
    Ok(text.to_owned())
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<String> {
    let (pairs, rest) = bytes.as_chunks::<2>();
    ensure!(rest.is_empty(), "the UTF-16 text ends in the middle of a character");
    let mut text = String::new();
    for character in char::decode_utf16(pairs.iter().map(|pair| unit(*pair))) {
        let Ok(character) = character else {
            bail!("line {}: incomplete UTF-16 character; save the file as UTF-8", 1 + text.matches('\n').count())
        };
        text.push(character);
    }
    Ok(text)
}
