//! Search of every byte of every file for a video's names and hashes, as text and as raw bytes, also inside `.npz` and
//! `.zip` archives (members of tar files are stored uncompressed). The names of files and folders are searched too.

use crate::file_name;
use anyhow::{Context, Result};
use orator_base::input;
use std::collections::BTreeSet;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Text or bytes to search for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SearchTerm {
    /// Description shown to the user.
    pub term: String,
    pub bytes: Vec<u8>,
    /// Whether a match must not follow a letter, digit, `-` or `_` (`a.mp4` does not match `extra.mp4`).
    pub needs_boundary: bool,
}

impl SearchTerm {
    /// Terms for a name, with a boundary before it: as it is, and as escaped in JSON, in HTML and in error messages,
    /// also with two of these escapes nested.
    pub fn name(term: &str, name: &str) -> Vec<Self> {
        let mut forms = BTreeSet::from([name.to_owned()]);
        for _ in 0..2 {
            let more: Vec<String> = forms.iter().flat_map(|form| escaped(form)).collect();
            forms.extend(more);
        }
        let term =
            |form: String| Self { term: format!("{term} {name}"), bytes: form.into_bytes(), needs_boundary: true };
        forms.into_iter().map(term).collect()
    }

    /// Terms for a hexadecimal hash: as text, and (from 16 bytes on) as the bytes it encodes.
    pub fn hash(term: &str, hex: &str) -> Vec<Self> {
        let text = Self { term: format!("{term} {hex}"), bytes: hex.as_bytes().to_vec(), needs_boundary: false };
        let digit = |byte: u8| char::from(byte).to_digit(16);
        let pairs = hex.as_bytes().as_chunks::<2>().0.iter();
        let raw: Option<Vec<u8>> = pairs.map(|[a, b]| Some((16 * digit(*a)? + digit(*b)?) as u8)).collect();
        // Short byte sequences occur by chance: any 4 bytes about once in 4 GiB.
        let raw = raw.filter(|raw| raw.len() >= 16);
        let raw = raw.map(|bytes| Self { term: format!("{term} {hex}, as bytes"), bytes, needs_boundary: false });
        [text].into_iter().chain(raw).collect()
    }
}

/// Escaped forms of a text: JSON inside an HTML page, JSON, HTML, and Rust debug format (error messages).
fn escaped(text: &str) -> [String; 4] {
    let inside = |quoted: String| quoted[1..quoted.len() - 1].to_owned();
    let json = inside(serde_json::Value::from(text).to_string());
    let entities = [('&', "&amp;"), ('<', "&lt;"), ('>', "&gt;"), ('"', "&quot;"), ('\'', "&#39;")];
    let page = entities.iter().fold(text.to_owned(), |text, (letter, entity)| text.replace(*letter, entity));
    [json.replace('<', "\\u003c"), json, page, inside(format!("{text:?}"))]
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SearchHit {
    /// Path of the file; for an archive, followed by `!` and the name of the entry.
    pub file: String,
    /// Byte offset of the match; `None`: in the name of the file.
    pub at: Option<u64>,
    pub term: String,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SearchReport {
    pub n_files: usize,
    /// Bytes of the searched files.
    pub bytes: u64,
    /// Uncompressed bytes of the searched archive entries.
    pub inside_bytes: u64,
    pub hits: Vec<SearchHit>,
}

/// Bytes read at a time.
const PIECE: usize = 1 << 20;

/// Searches everything below `folders`; terms of fewer than 2 bytes are ignored.
///
/// # Errors
/// A file that cannot be read, since it may contain a term.
pub fn search(folders: &[PathBuf], terms: &[SearchTerm]) -> Result<SearchReport> {
    let mut searched = SearchReport::default();
    let terms: Vec<&SearchTerm> = terms.iter().filter(|term| term.bytes.len() >= 2).collect();
    for folder in folders {
        walk(folder, folder, &terms, &mut searched)?;
    }
    Ok(searched)
}

/// Whether `bytes` contain one of the terms.
pub fn is_in(bytes: &[u8], terms: &[SearchTerm]) -> bool {
    let terms: Vec<&SearchTerm> = terms.iter().filter(|term| term.bytes.len() >= 2).collect();
    let mut scan = Scan::new(&terms);
    scan.piece(bytes);
    !scan.found.is_empty()
}

fn walk(root: &Path, path: &Path, terms: &[&SearchTerm], searched: &mut SearchReport) -> Result<()> {
    let reading = || format!("cannot search {}", path.display());
    if !path.exists() && !path.is_symlink() {
        return Ok(());
    }
    if path != root {
        let name = file_name(path);
        let mut scan = Scan::new(terms);
        scan.piece(name.as_bytes());
        let found =
            scan.found.into_iter().map(|(_, term)| SearchHit { file: path.display().to_string(), at: None, term });
        searched.hits.extend(found);
    }
    if path.is_dir() && !path.is_symlink() {
        let entries = std::fs::read_dir(path).with_context(reading)?;
        let mut entries = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>().with_context(reading)?;
        entries.sort();
        return entries.iter().try_for_each(|entry| walk(root, entry, terms, searched));
    }
    // Pipes, sockets, dangling links and links to folders have no content.
    match path.metadata() {
        Ok(meta) if !meta.is_file() => return Ok(()),
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        _ => {}
    }
    searched.n_files += 1;
    let (bytes, found) = scan(input::open(path).with_context(reading)?, terms).with_context(reading)?;
    searched.bytes += bytes;
    let to_hit = |file: &str, (at, term)| SearchHit { file: file.to_owned(), at: Some(at), term };
    let file = path.display().to_string();
    searched.hits.extend(found.into_iter().map(|found| to_hit(&file, found)));
    if path.extension().is_some_and(|ending| ending == "npz" || ending == "zip") {
        // A file that is not a valid archive has already been searched as plain bytes.
        let Ok(mut archive) = zip::ZipArchive::new(input::open(path).with_context(reading)?) else { return Ok(()) };
        for n in 0..archive.len() {
            let entry = archive.by_index(n).with_context(reading)?;
            let inside = format!("{file}!{}", entry.name());
            let (bytes, found) = scan(entry, terms).with_context(reading)?;
            searched.inside_bytes += bytes;
            searched.hits.extend(found.into_iter().map(|found| to_hit(&inside, found)));
        }
    }
    Ok(())
}

/// Searches `from`; returns the number of bytes read, and the offset and description of each match.
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

/// Incremental search through bytes that arrive in pieces.
struct Scan<'a> {
    terms: &'a [&'a SearchTerm],
    /// For every possible pair of bytes (65,536 entries), whether a term starts with it.
    is_term_start: Vec<bool>,
    longest: usize,
    /// Last bytes of the previous piece, since a match may span two pieces.
    tail: Vec<u8>,
    /// Number of bytes received.
    at: u64,
    found: Vec<(u64, String)>,
}

impl<'a> Scan<'a> {
    fn new(terms: &'a [&'a SearchTerm]) -> Self {
        let mut is_term_start = vec![false; 1 << 16];
        terms.iter().for_each(|term| is_term_start[pair(&term.bytes)] = true);
        let longest = terms.iter().map(|term| term.bytes.len()).max().unwrap_or(0);
        Self { terms, is_term_start, longest, tail: Vec::new(), at: 0, found: Vec::new() }
    }

    fn piece(&mut self, piece: &[u8]) {
        let n_tail = self.tail.len();
        let mut bytes = std::mem::take(&mut self.tail);
        bytes.extend_from_slice(piece);
        let start = self.at - n_tail as u64;
        for at in 0..bytes.len().saturating_sub(1) {
            if !self.is_term_start[pair(&bytes[at..])] {
                continue;
            }
            for term in self.terms {
                let end = at + term.bytes.len();
                // A match that ends within the tail was found with the previous piece.
                let new = end > n_tail && bytes.get(at..end) == Some(term.bytes.as_slice());
                let before = at.checked_sub(1).map(|before| bytes[before]);
                let is_joined = before.is_some_and(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_');
                if new && !(term.needs_boundary && is_joined) {
                    self.found.push((start + at as u64, term.term.clone()));
                }
            }
        }
        self.at += piece.len() as u64;
        // As long as the longest term: one byte more than a split match needs, for the boundary check.
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
    fn terms_are_found_in_every_kind_of_file_and_only_as_complete_names() {
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
            searched.hits.iter().map(|p| p.file.rsplit('/').next().unwrap().to_owned()).collect();
        files.dedup();
        assert!(files.contains(&"x.npz!y.npy".to_owned()) && files.contains(&"a.mp4".to_owned()), "{files:?}");
        let count = |name: &str| searched.hits.iter().filter(|p| p.file.ends_with(name)).count();
        assert_eq!([count("text.json"), count("binary.bin"), count("hex.txt"), count("clean.txt")], [1, 1, 1, 0]);
        assert_eq!(searched.hits.iter().find(|p| p.file.ends_with("binary.bin")).unwrap().at, Some(100));
        assert_eq!(searched.n_files, 5);
    }

    #[test]
    fn a_name_is_found_in_every_escaped_form() {
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
    fn a_match_across_two_blocks_is_found_once() {
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
