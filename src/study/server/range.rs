//! The header `Range` of HTTP (RFC 9110, section 14): one range of bytes.

/// What part of a file is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmPart {
    /// All: no range, several, or one in another unit or form, which a server may pass over.
    Whole,
    /// Bytes `first` to `last`, both counted.
    Bytes { first: u64, last: u64 },
    /// Beyond the end.
    Unsatisfiable,
}

/// Part of a file of `size` bytes that `header` asks for.
pub fn part(header: Option<&str>, size: u64) -> FilmPart {
    let Some((from, to)) = header.and_then(|header| header.strip_prefix("bytes=")).and_then(|set| set.split_once('-'))
    else {
        return FilmPart::Whole;
    };
    // A number beyond 2^64 is beyond every end.
    let number = |digits: &str| digits.bytes().all(|b| b.is_ascii_digit()).then(|| digits.parse().unwrap_or(u64::MAX));
    let (Some(from_number), Some(to_number)) = (number(from), number(to)) else { return FilmPart::Whole };
    let (first, last) = match (from.is_empty(), to.is_empty()) {
        (true, true) => return FilmPart::Whole,
        (true, false) if to_number == 0 => return FilmPart::Unsatisfiable,
        (true, false) => (size.saturating_sub(to_number), u64::MAX),
        (false, true) => (from_number, u64::MAX),
        (false, false) if from_number > to_number => return FilmPart::Whole,
        (false, false) => (from_number, to_number),
    };
    if first < size { FilmPart::Bytes { first, last: last.min(size - 1) } } else { FilmPart::Unsatisfiable }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_range_is_read_and_all_else_is_the_whole() {
        let bytes = |first, last| FilmPart::Bytes { first, last };
        let cases = [
            ("bytes=0-0", bytes(0, 0)),
            ("bytes=2-5", bytes(2, 5)),
            ("bytes=2-", bytes(2, 9)),
            ("bytes=-3", bytes(7, 9)),
            ("bytes=-300", bytes(0, 9)),
            ("bytes=9-18446744073709551616", bytes(9, 9)),
            ("bytes=10-", FilmPart::Unsatisfiable),
            ("bytes=99999999999999999999-", FilmPart::Unsatisfiable),
            ("bytes=-0", FilmPart::Unsatisfiable),
            ("bytes=5-2", FilmPart::Whole),
            ("bytes=-", FilmPart::Whole),
            ("bytes=", FilmPart::Whole),
            ("bytes=0-1,3-4", FilmPart::Whole),
            ("bytes=a-b", FilmPart::Whole),
            ("bytes=+1-2", FilmPart::Whole),
            ("bytes= 1-2", FilmPart::Whole),
            ("Bytes=1-2", FilmPart::Whole),
            ("frames=1-2", FilmPart::Whole),
            ("", FilmPart::Whole),
        ];
        for (header, expected) in cases {
            assert_eq!(part(Some(header), 10), expected, "{header}");
        }
        assert_eq!(part(None, 10), FilmPart::Whole);
        assert_eq!(part(Some("bytes=0-"), 0), FilmPart::Unsatisfiable);
    }
}
