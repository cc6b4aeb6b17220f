//! Search of every byte of every file for a video's names and hashes: as text, as raw bytes, and inside `.npz` archives
//! (members of tar files are stored uncompressed). Names of files and folders are searched too.

use crate::file_name;
use anyhow::{Context, Result};
use orator_base::input;
use std::collections::BTreeSet;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Text or bytes that must not be found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SearchTerm {
    /// Description for people.
    pub what: String,
    pub bytes: Vec<u8>,
    /// Whether matches need a boundary: no letter, digit, `-` or `_` before it (`a.mp4` is not in `extra.mp4`).
    pub whole: bool,
}

impl SearchTerm {
    /// Terms for a name, with a boundary: as it is, and as JSON, a page and an error message write it, also one inside the
    /// other.
    pub fn name(what: &str, name: &str) -> Vec<Self> {
        let mut forms = BTreeSet::from([name.to_owned()]);
        for _ in 0..2 {
            let more: Vec<String> = forms.iter().flat_map(|form| escaped(form)).collect();
            forms.extend(more);
        }
        let term = |form: String| Self { what: format!("{what} {name}"), bytes: form.into_bytes(), whole: true };
        forms.into_iter().map(term).collect()
    }

    /// Terms for hexadecimal digits: as text and as the bytes they encode.
    pub fn hash(what: &str, hex: &str) -> Vec<Self> {
        let text = Self { what: format!("{what} {hex}"), bytes: hex.as_bytes().to_vec(), whole: false };
        let digit = |byte: u8| char::from(byte).to_digit(16);
        let pairs = hex.as_bytes().as_chunks::<2>().0.iter();
        let raw: Option<Vec<u8>> = pairs.map(|[a, b]| Some((16 * digit(*a)? + digit(*b)?) as u8)).collect();
        // Four bytes occur by chance in any gigabyte.
        let raw = raw.filter(|raw| raw.len() >= 16);
        let raw = raw.map(|bytes| Self { what: format!("{what} {hex}, as bytes"), bytes, whole: false });
        [text].into_iter().chain(raw).collect()
    }
}

/// A text as it stands in JSON, in the JSON of a page, in a page, and in an error message.
fn escaped(text: &str) -> [String; 4] {
    let inside = |quoted: String| quoted[1..quoted.len() - 1].to_owned();
    let json = inside(serde_json::Value::from(text).to_string());
    let entities = [('&', "&amp;"), ('<', "&lt;"), ('>', "&gt;"), ('"', "&quot;"), ('\'', "&#39;")];
    let page = entities.iter().fold(text.to_owned(), |text, (letter, entity)| text.replace(*letter, entity));
    [json.replace('<', "\\u003c"), json, page, inside(format!("{text:?}"))]
}

/// Occurrence of a term.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SearchHit {
    /// File; for an archive followed by `!` and the entry.
    pub file: String,
    /// Offset; `None`: in the name.
    pub at: Option<u64>,
    pub what: String,
}

/// Result of a search.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Searched {
    pub n_files: usize,
    /// Bytes of the files, and of the contents of archives.
    pub bytes: u64,
    pub inside_bytes: u64,
    pub places: Vec<SearchHit>,
}

/// Bytes read at a time.
const PIECE: usize = 1 << 20;

/// Searches everything below `folders`.
///
/// # Errors
/// A file that cannot be read, since it proves nothing.
pub fn search(folders: &[PathBuf], terms: &[SearchTerm]) -> Result<Searched> {
    let mut searched = Searched::default();
    let terms: Vec<&SearchTerm> = terms.iter().filter(|term| term.bytes.len() >= 2).collect();
    for folder in folders {
        walk(folder, folder, &terms, &mut searched)?;
    }
    Ok(searched)
}

/// Whether one of the terms is in the bytes.
pub fn is_in(bytes: &[u8], terms: &[SearchTerm]) -> bool {
    let terms: Vec<&SearchTerm> = terms.iter().filter(|term| term.bytes.len() >= 2).collect();
    let mut scan = Scan::new(&terms);
    scan.piece(bytes);
    !scan.found.is_empty()
}

fn walk(root: &Path, path: &Path, terms: &[&SearchTerm], searched: &mut Searched) -> Result<()> {
    let reading = || format!("cannot search {}", path.display());
    if !path.exists() && !path.is_symlink() {
        return Ok(());
    }
    if path != root {
        let name = file_name(path);
        let mut scan = Scan::new(terms);
        scan.piece(name.as_bytes());
        let found =
            scan.found.into_iter().map(|(_, what)| SearchHit { file: path.display().to_string(), at: None, what });
        searched.places.extend(found);
    }
    if path.is_dir() && !path.is_symlink() {
        let entries = std::fs::read_dir(path).with_context(reading)?;
        let mut entries = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>().with_context(reading)?;
        entries.sort();
        return entries.iter().try_for_each(|entry| walk(root, entry, terms, searched));
    }
    // A pipe, a socket, a link to nothing or to a folder holds no bytes.
    match path.metadata() {
        Ok(meta) if !meta.is_file() => return Ok(()),
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        _ => {}
    }
    searched.n_files += 1;
    let (bytes, found) = scan(input::open(path).with_context(reading)?, terms).with_context(reading)?;
    searched.bytes += bytes;
    let place = |file: &str, (at, what)| SearchHit { file: file.to_owned(), at: Some(at), what };
    let file = path.display().to_string();
    searched.places.extend(found.into_iter().map(|found| place(&file, found)));
    if path.extension().is_some_and(|ending| ending == "npz" || ending == "zip") {
        // A file that is no archive was searched as it is.
        let Ok(mut archive) = zip::ZipArchive::new(input::open(path).with_context(reading)?) else { return Ok(()) };
        for n in 0..archive.len() {
            let entry = archive.by_index(n).with_context(reading)?;
            let inside = format!("{file}!{}", entry.name());
            let (bytes, found) = scan(entry, terms).with_context(reading)?;
            searched.inside_bytes += bytes;
            searched.places.extend(found.into_iter().map(|found| place(&inside, found)));
        }
    }
    Ok(())
}

/// Number of bytes read, and offset and description of each term found.
fn scan(mut from: impl Read, terms: &[&SearchTerm]) -> Result<(u64, Vec<(u64, String)>)> {
    let mut scan = Scan::new(terms);
    let mut piece = vec![0; PIECE];
    loop {
        let n = match from.read(&mut piece) {
            Ok(0) => break,
            Ok(n) => n,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(error.into()),
        };
        scan.piece(&piece[..n]);
    }
    Ok((scan.at, scan.found))
}

/// Search through bytes that arrive in pieces.
struct Scan<'a> {
    terms: &'a [&'a SearchTerm],
    /// For every pair of bytes, whether a term begins with it.
    begins: Vec<bool>,
    longest: usize,
    /// Last bytes of the previous piece, since a term may span two pieces.
    tail: Vec<u8>,
    /// Number of bytes before the tail.
    at: u64,
    found: Vec<(u64, String)>,
}

impl<'a> Scan<'a> {
    fn new(terms: &'a [&'a SearchTerm]) -> Self {
        let mut begins = vec![false; 1 << 16];
        terms.iter().for_each(|term| begins[pair(&term.bytes)] = true);
        let longest = terms.iter().map(|term| term.bytes.len()).max().unwrap_or(0);
        Self { terms, begins, longest, tail: Vec::new(), at: 0, found: Vec::new() }
    }

    fn piece(&mut self, piece: &[u8]) {
        let n_tail = self.tail.len();
        let mut bytes = std::mem::take(&mut self.tail);
        bytes.extend_from_slice(piece);
        let start = self.at - n_tail as u64;
        for at in 0..bytes.len().saturating_sub(1) {
            if !self.begins[pair(&bytes[at..])] {
                continue;
            }
            for term in self.terms {
                let end = at + term.bytes.len();
                // Matches that end in the tail were found before.
                let new = end > n_tail && bytes.get(at..end) == Some(term.bytes.as_slice());
                let before = at.checked_sub(1).map(|before| bytes[before]);
                let joined = before.is_some_and(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_');
                if new && !(term.whole && joined) {
                    self.found.push((start + at as u64, term.what.clone()));
                }
            }
        }
        self.at += piece.len() as u64;
        // One byte more than the longest term, which decides on the boundary.
        let keep = bytes.len().saturating_sub(self.longest);
        self.tail = bytes.split_off(keep);
    }
}

fn pair(bytes: &[u8]) -> usize {
    match bytes {
        [a, b, ..] => usize::from(*a) << 8 | usize::from(*b),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    fn terms() -> Vec<SearchTerm> {
        let hash = blake3::hash(b"a").to_hex().to_string();
        [SearchTerm::name("file", "a.mp4"), SearchTerm::hash("content", &hash)].concat()
    }

    #[test]
    fn a_mark_is_found_wherever_it_hides_and_whole_names_only() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| std::fs::write(dir.path().join(name), bytes).unwrap();
        let hash = blake3::hash(b"a");
        write("text.json", b"{\"file\": \"a.mp4\", \"other\": \"extra.mp4\"}");
        write("binary.bin", &[&[7; 100], hash.as_bytes().as_slice(), &[9; 50]].concat());
        write("hex.txt", format!("b3:{}", hash.to_hex()).as_bytes());
        write("clean.txt", b"extra.mp4 b-a.mp4");
        let mut npz = zip::ZipWriter::new(std::fs::File::create(dir.path().join("x.npz")).unwrap());
        npz.start_file("y.npy", zip::write::SimpleFileOptions::default()).unwrap();
        npz.write_all(b"header a.mp4").unwrap();
        npz.finish().unwrap();
        std::fs::create_dir(dir.path().join("a.mp4")).unwrap();
        std::os::unix::fs::symlink("nowhere", dir.path().join("link")).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(dir.path().join("pipe")).status().unwrap().success());
        let searched = search(&[dir.path().to_owned()], &terms()).unwrap();
        let mut files: Vec<String> =
            searched.places.iter().map(|p| p.file.rsplit('/').next().unwrap().to_owned()).collect();
        files.dedup();
        assert!(files.contains(&"x.npz!y.npy".to_owned()) && files.contains(&"a.mp4".to_owned()), "{files:?}");
        let count = |name: &str| searched.places.iter().filter(|p| p.file.ends_with(name)).count();
        assert_eq!([count("text.json"), count("binary.bin"), count("hex.txt"), count("clean.txt")], [1, 1, 1, 0]);
        assert_eq!(searched.places.iter().find(|p| p.file.ends_with("binary.bin")).unwrap().at, Some(100));
        assert_eq!(searched.n_files, 5);
    }

    #[test]
    fn a_name_is_found_however_it_is_written() {
        let name = "a \"b\" & <c>\n'd'.mp4";
        let terms = SearchTerm::name("file", name);
        let json = serde_json::json!({ "file": name, "error": format!("cannot read {name:?}") }).to_string();
        let page = "<p>a &quot;b&quot; &amp; &lt;c&gt;\n&#39;d&#39;.mp4</p>";
        for text in [name, &*json, page, &json.replace('<', "\\u003c"), &format!("{name:?}")] {
            assert!(is_in(text.as_bytes(), &terms), "{text}");
        }
        assert!(!is_in(b"a b & c d.mp4", &terms));
        assert_eq!(SearchTerm::name("file", "a.mp4").len(), 1);
    }

    #[test]
    fn a_mark_across_two_pieces_is_found_once() {
        let terms = terms();
        let terms: Vec<&SearchTerm> = terms.iter().collect();
        let text: Vec<u8> = [&[b' '; 300][..], b"a.mp4", &[b' '; 300]].concat();
        for step in [1, 2, 3, 7, 64, 305, 1000] {
            let mut scan = Scan::new(&terms);
            text.chunks(step).for_each(|piece| scan.piece(piece));
            assert_eq!(scan.found, [(300, "file a.mp4".to_owned())], "pieces of {step}");
            assert_eq!(scan.at, 605);
        }
    }
}
