//! Secrets of a study's server: the key that signs participants' tokens, and the operator's token.

use anyhow::{Context, Result, ensure};
use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use orator_base::stage::workdir;
use orator_web::files::{hex, random};
use serde::{Deserialize, Serialize};
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// Length of a participant's random identifier, bytes.
const ID_BYTES: usize = 12;
/// Length of a token, bytes: session, identifier, signature.
const TOKEN_BYTES: usize = 4 + ID_BYTES + blake3::OUT_LEN;
/// Characters of a completion code, without those that look alike.
const CODE_LETTERS: &[u8; 32] = b"ABCDEFGHJKLMNPQRSTUVWXYZ23456789";

/// Random completion code of ten characters.
pub fn completion_code() -> Result<String> {
    Ok(random::<10>()?.into_iter().map(|byte| char::from(CODE_LETTERS[usize::from(byte % 32)])).collect())
}

/// Random identifier of a participant, in hexadecimal digits.
pub fn participant_id() -> Result<String> {
    Ok(hex(&random::<ID_BYTES>()?))
}

/// Whether `attempt` has the form of a page's attempt to begin: 128 random bits in hexadecimal digits.
pub fn is_attempt(attempt: &str) -> bool {
    attempt.len() == 32 && attempt.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// Signing key and operator's token of one study.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudySecret {
    key: [u8; 32],
    operator_token: String,
}

impl StudySecret {
    /// Reads the secret at `path`; creates it if it does not exist.
    ///
    /// # Errors
    /// The file is readable by users other than its owner, or is not a valid secret.
    pub fn open(path: &Path) -> Result<Self> {
        if !path.exists() {
            let secret = Self { key: random()?, operator_token: hex(&random::<16>()?) };
            workdir::replace(path, |attempt| {
                fs::set_permissions(attempt, Permissions::from_mode(0o600))?;
                Ok(fs::write(attempt, serde_json::to_vec(&secret)?)?)
            })?;
        }
        let read = || -> Result<Self> {
            let mode = path.metadata()?.permissions().mode();
            let group_and_other_bits = mode & 0o077;
            ensure!(group_and_other_bits == 0, "users other than its owner can read it; run `chmod 600`");
            Ok(serde_json::from_slice(&fs::read(path)?)?)
        };
        read().with_context(|| format!("cannot use {}", path.display()))
    }

    pub fn operator_token(&self) -> &str {
        &self.operator_token
    }

    /// Whether `token` is the operator's token. Keyed hashes are compared, so timing reveals nothing about the token.
    pub fn is_operator(&self, token: &str) -> bool {
        self.sign(token.as_bytes()) == self.sign(self.operator_token.as_bytes())
    }

    /// Identifier of the participant who begins by this `attempt`. It is the same for a repeated request, and the
    /// attempt, which is as secret as a token, cannot be derived from it.
    pub fn id_of_attempt(&self, attempt: &str) -> String {
        let hash = self.sign(format!("attempt {attempt}").as_bytes());
        hex(hash.as_bytes().split_at(ID_BYTES).0)
    }

    /// Token of the participant `id` (from [`participant_id`] or [`Self::id_of_attempt`]) in `session`.
    pub fn token(&self, session: u32, id: &str) -> String {
        let mut bytes = session.to_le_bytes().to_vec();
        bytes.extend(unhex(id));
        let signature = self.sign(&bytes);
        bytes.extend(signature.as_bytes());
        URL_SAFE_NO_PAD.encode(bytes)
    }

    /// Session and identifier of a token's participant; `None` if this study's key did not sign it.
    pub fn verify(&self, token: &str) -> Option<(u32, String)> {
        let bytes: [u8; TOKEN_BYTES] = URL_SAFE_NO_PAD.decode(token).ok()?.try_into().ok()?;
        let (payload, signature) = bytes.split_at(4 + ID_BYTES);
        let (session, id) = payload.split_at(4);
        let signature = blake3::Hash::from_bytes(signature.try_into().ok()?);
        // `blake3::Hash` compares in constant time.
        let is_signed = self.sign(payload) == signature;
        is_signed.then(|| Some((u32::from_le_bytes(session.try_into().ok()?), hex(id)))).flatten()
    }

    fn sign(&self, bytes: &[u8]) -> blake3::Hash {
        blake3::keyed_hash(&self.key, bytes)
    }
}

fn unhex(text: &str) -> Vec<u8> {
    let pairs = text.as_bytes().chunks_exact(2).filter_map(|pair| std::str::from_utf8(pair).ok());
    pairs.filter_map(|pair| u8::from_str_radix(pair, 16).ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn altered_and_truncated_tokens_are_rejected() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("secret.json");
        let secret = StudySecret::open(&path).unwrap();
        assert_eq!(path.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        let id = participant_id().unwrap();
        let token = secret.token(7, &id);
        assert_eq!(StudySecret::open(&path).unwrap().verify(&token), Some((7, id.clone())), "the same key again");
        for k in 0..token.len() {
            let mut letters = token.clone().into_bytes();
            letters[k] = if letters[k] == b'A' { b'B' } else { b'A' };
            assert_eq!(secret.verify(std::str::from_utf8(&letters).unwrap()), None, "letter {k}");
            assert_eq!(secret.verify(&token[..k]), None, "{k} letters");
        }
        let attempt = "0123456789abcdef0123456789abcdef";
        let of_attempt = secret.id_of_attempt(attempt);
        assert_eq!(StudySecret::open(&path).unwrap().id_of_attempt(attempt), of_attempt);
        assert!(of_attempt.len() == id.len() && of_attempt != secret.id_of_attempt(&attempt.replace('0', "1")));
        assert!(is_attempt(attempt) && !is_attempt(&attempt.to_uppercase()) && !is_attempt(&attempt[1..]));
        for wrong in ["", "=", "\u{e9}", &format!("{token}="), &format!("{token}AAAA"), &token.repeat(100)] {
            assert_eq!(secret.verify(wrong), None, "{wrong}");
        }
        let other = StudySecret { key: random().unwrap(), operator_token: String::new() };
        assert_eq!(other.verify(&token), None, "another study's");
        assert!(secret.is_operator(secret.operator_token()) && !secret.is_operator("") && !secret.is_operator(&token));
        fs::set_permissions(&path, Permissions::from_mode(0o644)).unwrap();
        assert!(format!("{:#}", StudySecret::open(&path).err().unwrap()).contains("chmod 600"));
    }
}
