//! Tokens of Whisper: byte-level byte-pair encoding of text, read from `tokenizer.json`, and the special tokens.

use anyhow::{Context as _, Result, anyhow, ensure};
use std::path::Path;

/// Text to tokens and back, and the special tokens that control the decoder.
pub struct Tokenizer {
    encoder: tokenizers::Tokenizer,
    /// UTF-8 bytes of each text token, by its number; a character may be divided between tokens.
    bytes: Vec<Vec<u8>>,
    sot: u32,
    start_of_previous: u32,
    eot: u32,
    translate: u32,
    transcribe: u32,
    no_speech: u32,
    no_timestamps: u32,
}

impl Tokenizer {
    /// Reads `tokenizer.json` in the folder `dir`.
    ///
    /// # Errors
    /// The file is missing, invalid, or lacks the special tokens of Whisper.
    pub fn open(dir: &Path) -> Result<Self> {
        let path = dir.join("tokenizer.json");
        let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::from_json(&bytes).with_context(|| format!("invalid tokenizer {}", path.display()))
    }

    fn from_json(json: &[u8]) -> Result<Self> {
        let mut encoder = tokenizers::Tokenizer::from_bytes(json).map_err(|error| anyhow!("{error}"))?;
        // Text that looks like a special token stays text.
        encoder.set_encode_special_tokens(true);
        let special = |names: &[&str]| {
            let id = names.iter().find_map(|name| encoder.token_to_id(name));
            id.with_context(|| format!("expected the special token {}", names.join(" or ")))
        };
        let eot = special(&["<|endoftext|>"])?;
        let [sot, start_of_previous] = [special(&["<|startoftranscript|>"])?, special(&["<|startofprev|>"])?];
        let [translate, transcribe] = [special(&["<|translate|>"])?, special(&["<|transcribe|>"])?];
        let no_speech = special(&["<|nospeech|>", "<|nocaptions|>"])?;
        let no_timestamps = special(&["<|notimestamps|>"])?;
        let is_ordered =
            eot < sot && sot < translate && [translate, transcribe, no_speech].iter().max() < Some(&no_timestamps);
        ensure!(is_ordered, "expected the special tokens in the order of Whisper, <|notimestamps|> last");
        let mut bytes = vec![Vec::new(); eot as usize];
        for (text, id) in encoder.get_vocab(false) {
            if let Some(bytes) = bytes.get_mut(id as usize) {
                *bytes = text.chars().flat_map(token_bytes).collect();
            }
        }
        Ok(Self { encoder, bytes, sot, start_of_previous, eot, translate, transcribe, no_speech, no_timestamps })
    }

    /// Tokens of a text, without special tokens.
    pub fn encode(&self, text: &str) -> Vec<u32> {
        self.encoder.encode_fast(text, false).map(|encoding| encoding.get_ids().to_vec()).unwrap_or_default()
    }

    /// Text of tokens; special tokens and timestamps are left out, incomplete characters are replaced by U+FFFD.
    pub fn decode(&self, tokens: &[u32]) -> String {
        let bytes: Vec<u8> = tokens.iter().flat_map(|&token| self.bytes_of(token)).copied().collect();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Splits tokens into the shortest pieces of complete characters: the text of each, and its number of tokens.
    pub(crate) fn pieces(&self, tokens: &[u32]) -> Vec<(String, usize)> {
        let (mut pieces, mut bytes, mut n) = (Vec::new(), Vec::new(), 0);
        for (nth, &token) in tokens.iter().enumerate() {
            bytes.extend_from_slice(self.bytes_of(token));
            n += 1;
            let is_incomplete = std::str::from_utf8(&bytes).is_err_and(|error| error.error_len().is_none());
            if !is_incomplete || nth + 1 == tokens.len() {
                pieces.push((String::from_utf8_lossy(&bytes).into_owned(), n));
                bytes.clear();
                n = 0;
            }
        }
        pieces
    }

    fn bytes_of(&self, token: u32) -> &[u8] {
        self.bytes.get(token as usize).map_or(&[], Vec::as_slice)
    }

    /// Start of a transcript.
    pub fn sot(&self) -> u32 {
        self.sot
    }

    /// Start of the text that precedes the window.
    pub fn start_of_previous(&self) -> u32 {
        self.start_of_previous
    }

    /// End of the text; all lower numbers are text.
    pub fn eot(&self) -> u32 {
        self.eot
    }

    /// Task: text in the language that is spoken.
    pub fn transcribe(&self) -> u32 {
        self.transcribe
    }

    /// Its probability as the first token is that of a window without speech.
    pub fn no_speech(&self) -> u32 {
        self.no_speech
    }

    /// Request for text without timestamps.
    pub fn no_timestamps(&self) -> u32 {
        self.no_timestamps
    }

    /// Timestamp of 0 s; each further token is 20 ms later.
    pub fn timestamp_begin(&self) -> u32 {
        self.no_timestamps + 1
    }

    /// Token of a language, for example `en`.
    pub fn language(&self, code: &str) -> Option<u32> {
        self.encoder.token_to_id(&format!("<|{code}|>")).filter(|id| self.language_tokens().contains(id))
    }

    /// Tokens of all languages.
    pub(crate) fn language_tokens(&self) -> std::ops::Range<u32> {
        self.sot + 1..self.translate.min(self.transcribe)
    }

    /// Code of the language with this token.
    pub(crate) fn language_code(&self, token: u32) -> String {
        let name = self.encoder.id_to_token(token).unwrap_or_default();
        name.trim_matches(['<', '|', '>']).to_owned()
    }
}

/// Bytes that a character in the vocabulary stands for: printable bytes of Latin-1 stand for themselves, the 68 others
/// are written as the characters from U+0100 on.
fn token_bytes(letter: char) -> Vec<u8> {
    let is_printable = |byte: u8| matches!(byte, 0x21..=0x7e | 0xa1..=0xac | 0xae..=0xff);
    let written = u32::from(letter);
    let byte = match u8::try_from(written) {
        Ok(byte) => Some(byte).filter(|&byte| is_printable(byte)),
        Err(_) => (0..=u8::MAX).filter(|&byte| !is_printable(byte)).nth(written as usize - 0x100),
    };
    byte.map_or_else(|| letter.to_string().into_bytes(), |byte| vec![byte])
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use serde_json::json;

    /// A vocabulary of the 256 bytes, ` the`, and the special tokens, numbered from 0 as in Whisper.
    pub(crate) fn byte_tokenizer() -> Tokenizer {
        let letters = (0x21..0x180).filter_map(char::from_u32).filter(|&letter| letter != '\u{7f}');
        let letters = letters.filter(|&letter| token_bytes(letter).len() == 1);
        let mut letters: Vec<(u8, char)> = letters.map(|letter| (token_bytes(letter)[0], letter)).collect();
        letters.sort_unstable();
        assert_eq!(letters.len(), 256);
        let merged = ["th", "the", "\u{120}the"].map(str::to_owned);
        let texts = letters.iter().map(|(_, letter)| letter.to_string()).chain(merged);
        let vocab: serde_json::Map<_, _> = texts.enumerate().map(|(id, text)| (text, json!(id))).collect();
        let special = ["endoftext", "startoftranscript", "en", "de", "ja", "translate", "transcribe", "startoflm"];
        let special = special.iter().chain(&["startofprev", "nospeech", "notimestamps"]).enumerate();
        let added = special.map(|(nth, name)| {
            json!({ "id": vocab.len() + nth, "content": format!("<|{name}|>"), "special": true, "single_word": false,
                    "lstrip": false, "rstrip": false, "normalized": false })
        });
        let byte_level =
            json!({ "type": "ByteLevel", "add_prefix_space": false, "trim_offsets": true, "use_regex": true });
        let added: Vec<_> = added.collect();
        let json = json!({
            "version": "1.0", "added_tokens": added, "pre_tokenizer": byte_level, "decoder": byte_level,
            "model": { "type": "BPE", "vocab": vocab, "merges": ["t h", "th e", "\u{120} the"] },
        });
        Tokenizer::from_json(json.to_string().as_bytes()).unwrap()
    }

    #[test]
    fn texts_of_all_scripts_survive_encoding() {
        let tokenizer = byte_tokenizer();
        for text in [
            "",
            " the other",
            "na\u{ef}ve \u{1f600}\u{1f468}\u{200d}\u{1f469}",
            "\u{65e5}\u{672c}\u{8a9e}",
            "<|en|>\0\u{ad}",
        ] {
            let tokens = tokenizer.encode(text);
            assert!(tokens.iter().all(|&token| token < tokenizer.eot()), "{text:?}: {tokens:?}");
            assert_eq!(tokenizer.decode(&tokens), text);
            let pieces = tokenizer.pieces(&tokens);
            assert_eq!(pieces.iter().map(|(text, _)| text.as_str()).collect::<String>(), text);
            assert_eq!(pieces.iter().map(|(_, n)| n).sum::<usize>(), tokens.len());
        }
        assert_eq!(tokenizer.encode(" the").len(), 1);
        assert_eq!(tokenizer.pieces(&tokenizer.encode("\u{65e5}\u{672c}")).len(), 2);
        // Bytes that form no character, special tokens and unknown numbers.
        assert_eq!(tokenizer.decode(&[0xe6, 0x97, u32::from(b'a'), tokenizer.eot(), u32::MAX]), "\u{fffd}a");
        assert_eq!(tokenizer.pieces(&[0xff, 0xe6]), [("\u{fffd}".to_owned(), 1), ("\u{fffd}".to_owned(), 1)]);
    }

    #[test]
    fn special_tokens_are_found_by_name() {
        let tokenizer = byte_tokenizer();
        assert_eq!([tokenizer.eot(), tokenizer.sot(), tokenizer.timestamp_begin()], [259, 260, 270]);
        assert_eq!(
            [tokenizer.language("de"), tokenizer.language("xx"), tokenizer.language("transcribe")],
            [Some(262), None, None]
        );
        assert_eq!((tokenizer.language_code(263).as_str(), tokenizer.language_tokens()), ("ja", 261..264));
        let error = Tokenizer::open(Path::new("/nowhere")).err().unwrap();
        assert!(format!("{error:#}").contains("/nowhere/tokenizer.json"), "{error:#}");
        assert!(Tokenizer::from_json(b"{}").is_err());
    }
}
