//! Names of films that tell nothing: 16 hexadecimal digits of a keyed hash of what a film shows.

use crate::plan::{FilmContent, FilmSound};

/// What the keys of names are made for.
const CONTEXT: &str = "orator study 2026 names of films";

/// Name of the film of that content in the study of that seed.
pub fn film_name(seed: u64, content: &FilmContent) -> String {
    let key = blake3::derive_key(CONTEXT, &seed.to_le_bytes());
    let FilmContent { clip, speaker, condition, motion_of, number, sound } = content;
    let number = number.map_or(String::new(), |number| number.to_string());
    let sound = match sound {
        FilmSound::Speech => "speech",
        FilmSound::Silence => "silence",
        FilmSound::Tones => "tones",
    };
    let mut hasher = blake3::Hasher::new_keyed(&key);
    for part in [clip.as_str(), speaker, condition, motion_of, &number, sound] {
        // The length keeps neighbouring parts apart.
        hasher.update(&(part.len() as u64).to_le_bytes()).update(part.as_bytes());
    }
    hasher.finalize().to_hex().as_str()[..16].to_owned()
}
