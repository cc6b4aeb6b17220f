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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodings_are_detected_and_others_rejected_with_their_line() {
        let utf16 = |swap: bool| {
            let units = "\u{feff}sö\n".encode_utf16();
            let bytes = units.map(|unit| if swap { unit.to_be_bytes() } else { unit.to_le_bytes() });
            bytes.collect::<Vec<_>>().concat()
        };
        for bytes in [utf16(false), utf16(true), "sö\n".into(), "\u{feff}sö\n".into()] {
            assert_eq!(text_of(&bytes).unwrap(), "sö\n");
        }
        assert!(text_of(b"so\nsch\xf6n").unwrap_err().to_string().starts_with("line 2: byte 0xf6"));
        assert!(text_of(b"s\0o\0\n\0").unwrap_err().to_string().contains("UTF-16"));
        assert!(text_of(b"\xff\xfes").is_err());
        assert!(text_of(b"\xff\xfe\x00\xd8\x00\x00").unwrap_err().to_string().starts_with("line 1"));
    }
}
