//! Films of one length in bytes: an mp4 is made longer by a `free` box at its end, which players skip.

use anyhow::{Context, Result};

/// Least length of a box: its own length and its type.
const HEADER_BYTES: usize = 8;
/// Lengths are rounded up to a multiple of this.
const STEP_BYTES: usize = 4096;

/// Length that films of these lengths can all have.
pub fn common_bytes(lengths: impl IntoIterator<Item = usize>) -> usize {
    let longest = lengths.into_iter().max().unwrap_or(0);
    (longest + HEADER_BYTES).next_multiple_of(STEP_BYTES)
}

/// Appends a box of zeros to an mp4, so that it has `n_bytes`.
///
/// # Errors
/// A film that is longer, or shorter by less than a box or by more than 4 GB.
pub fn padded(mut film: Vec<u8>, n_bytes: usize) -> Result<Vec<u8>> {
    let missing = n_bytes.checked_sub(film.len()).filter(|missing| *missing >= HEADER_BYTES);
    let size = missing.and_then(|missing| u32::try_from(missing).ok());
    let size = size.with_context(|| format!("{} bytes cannot become {n_bytes}", film.len()))?;
    film.extend(size.to_be_bytes());
    film.extend(b"free");
    film.resize(n_bytes, 0);
    Ok(film)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn films_become_equally_long() {
        let lengths = [4_080, 4_085, 12, 4_088];
        let n_bytes = common_bytes(lengths);
        assert_eq!((n_bytes, common_bytes([4_089]), common_bytes([])), (4_096, 8_192, 4_096));
        for length in lengths {
            let film = padded(vec![7; length], n_bytes).unwrap();
            assert_eq!(film.len(), n_bytes);
            let free = &film[length..];
            assert_eq!((&free[..4], &free[4..8]), (&((n_bytes - length) as u32).to_be_bytes()[..], &b"free"[..]));
            assert!(free[8..].iter().all(|byte| *byte == 0));
            assert!(padded(film, n_bytes + 3).is_err());
        }
    }
}
