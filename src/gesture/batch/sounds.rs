//! The sounds of a batch and the names of their motions, from a folder or from a table of comma-separated values (RFC
//! 4180; semicolons and tabs are accepted too).

use anyhow::{Context, Result, bail, ensure};
use orator_avatar::animate::export::file::ExportFormat;
use orator_base::input;
use orator_base::text::counted;
use orator_dataset::config::patterns::{SOUND_EXTENSIONS, TRANSCRIPT_EXTENSIONS, VIDEO_EXTENSIONS, has_extension};
use orator_formats::mocap::motion_file::stem;
use orator_formats::search;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BatchSound {
    /// Sound or video file.
    pub audio: PathBuf,
    /// Path of the motion below the output folder, with `/` between folders and without an extension.
    pub name: String,
    /// Checkpoint, if it differs from that of the batch.
    pub checkpoint: Option<PathBuf>,
    /// Transcript, for networks that read words.
    pub transcript: Option<PathBuf>,
}

/// All sounds below `folder`, named after their files, including the extension if two names would be equal. Files below
/// the output folder `out` are skipped, since generated films contain sound too. Also returns the names of the files
/// that are neither sounds nor transcripts.
///
/// # Errors
/// A path that is not a folder, a folder without sounds, or `out` equal to `folder`.
pub fn of_folder(folder: &Path, out: &Path) -> Result<(Vec<BatchSound>, Vec<String>)> {
    ensure!(folder.is_dir(), "{} is not a folder", folder.display());
    let out = out.canonicalize().ok();
    ensure!(
        out != folder.canonicalize().ok(),
        "the motions would be written to the folder of the audio files, {}; choose another --out-folder, such as {}",
        folder.display(),
        folder.join("motions").display()
    );
    let mut enter = |folder: &Path| folder.canonicalize().ok() != out;
    let endings = [&SOUND_EXTENSIONS[..], &VIDEO_EXTENSIONS].concat();
    let relative = |path: PathBuf| (path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned(), path);
    let all = search::files(folder, &mut enter)?.into_iter().map(relative);
    let (files, mut others): (Vec<_>, Vec<_>) = all.partition(|(_, path)| has_extension(path, &endings));
    others.retain(|(_, path)| !has_extension(path, &TRANSCRIPT_EXTENSIONS));
    ensure!(!files.is_empty(), "no audio or video files in {}: expected {}", folder.display(), endings.join(", "));
    let stem = |file: &str| file.rsplit_once('.').map_or(file, |(stem, _)| stem).to_owned();
    let mut name_counts = BTreeMap::<String, usize>::new();
    files.iter().for_each(|(file, _)| *name_counts.entry(stem(file).to_lowercase()).or_default() += 1);
    let rows = files.into_iter().map(|(file, audio)| {
        let is_unique = name_counts.get(&stem(&file).to_lowercase()) == Some(&1);
        BatchSound {
            audio,
            name: if is_unique { stem(&file) } else { file.replacen('.', "_", usize::MAX) },
            checkpoint: None,
            transcript: None,
        }
    });
    Ok((distinct(rows.collect())?, others.into_iter().map(|(file, _)| file).collect()))
}

/// Sounds of the table `path` with the column `audio`, and optionally `out`, `checkpoint` (or `speaker`) and
/// `transcript`. Paths are relative to the folder of the table. Errors name the line.
pub fn of_table(path: &Path) -> Result<Vec<BatchSound>> {
    let bytes = input::read(path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
    let text = std::str::from_utf8(&bytes).with_context(|| format!("{} is not UTF-8 text", path.display()))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    parse(text, folder).and_then(distinct).with_context(|| format!("invalid table {}", path.display()))
}

/// As [`of_table`], from its text; paths are relative to `folder`, and equal names are not found.
pub fn parse(text: &str, folder: &Path) -> Result<Vec<BatchSound>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let heads = text.lines().next().unwrap_or_default();
    let delimiter =
        [',', ';', '\t'].into_iter().max_by_key(|c| heads.matches(*c).count()).filter(|c| heads.contains(*c));
    let mut lines = fields(text, delimiter.unwrap_or(','))?.into_iter();
    let (_, heads) = lines
        .next()
        .context("it is empty; expected column names in the first line: audio,out,checkpoint,transcript")?;
    let heads: Vec<String> = heads.iter().map(|head| head.trim().to_lowercase()).collect();
    for head in &heads {
        let known = ["audio", "out", "checkpoint", "speaker", "transcript"].contains(&head.as_str());
        ensure!(known, "line 1: unknown column `{head}`: expected audio, out, checkpoint, transcript");
    }
    let column = |names: &[&str]| heads.iter().position(|head| names.contains(&head.as_str()));
    let audio = column(&["audio"]).context("line 1: no column `audio`")?;
    let (out, checkpoint, transcript) = (column(&["out"]), column(&["checkpoint", "speaker"]), column(&["transcript"]));
    let mut rows = Vec::new();
    for (line, fields) in lines {
        let field = |at: Option<usize>| at.and_then(|at| fields.get(at)).map(|f| f.trim()).filter(|f| !f.is_empty());
        let n = (fields.len(), heads.len());
        ensure!(n.0 <= n.1, "line {line}: {} for {}", counted(n.0, "field"), counted(n.1, "column"));
        let Some(file) = field(Some(audio)) else { bail!("line {line}: no audio file") };
        let name = match field(out) {
            Some(out) => motion_name(out).with_context(|| format!("line {line}"))?,
            None => motion_name(&Path::new(file).file_stem().unwrap_or_default().to_string_lossy())
                .with_context(|| format!("line {line}"))?,
        };
        rows.push(BatchSound {
            audio: folder.join(file),
            name,
            checkpoint: field(checkpoint).map(|path| folder.join(path)),
            transcript: field(transcript).map(|path| folder.join(path)),
        });
    }
    ensure!(!rows.is_empty(), "no audio files below the column names");
    Ok(rows)
}

/// Name of a motion as given in a table: a relative path below the output folder, without the extension of a format.
fn motion_name(out: &str) -> Result<String> {
    let path = Path::new(out);
    let path = if ExportFormat::from_path(path).is_ok() { path.with_file_name(stem(path)) } else { path.to_owned() };
    let parts: Option<Vec<String>> = path
        .components()
        .filter(|part| *part != Component::CurDir)
        .map(|part| if let Component::Normal(part) = part { part.to_str().map(str::to_owned) } else { None })
        .collect();
    let parts = parts.filter(|parts| !parts.is_empty() && !parts.iter().any(|part| part.starts_with('.')));
    let parts = parts.with_context(|| format!("invalid out `{out}`: expected a path below the output folder"))?;
    Ok(parts.join("/"))
}

/// Fails if two motions would be written to the same file; case is ignored, as by many file systems.
pub fn distinct(rows: Vec<BatchSound>) -> Result<Vec<BatchSound>> {
    let mut seen = BTreeMap::new();
    for row in &rows {
        if let Some(other) = seen.insert(row.name.to_lowercase(), &row.audio) {
            bail!("{} and {} would both be written to `{}`", other.display(), row.audio.display(), row.name);
        }
    }
    Ok(rows)
}

/// Line number and fields of each line that is not empty.
fn fields(text: &str, delimiter: char) -> Result<Vec<(usize, Vec<String>)>> {
    let mut table = csv::ReaderBuilder::new()
        .delimiter(delimiter as u8)
        .has_headers(false)
        .flexible(true)
        .from_reader(text.as_bytes());
    let (mut rows, mut last) = (Vec::new(), (1, ""));
    for record in table.records() {
        let record = record?;
        // The position is before any empty lines that precede the record.
        let (line, rest) = record.position().map_or((1, text), |at| (at.line() as usize, &text[at.byte() as usize..]));
        let body = rest.trim_start_matches(['\r', '\n']);
        let line = line + rest[..rest.len() - body.len()].matches('\n').count();
        rows.push((line, record.iter().map(str::to_owned).collect::<Vec<_>>()));
        last = (line, body);
    }
    // An open quotation mark reaches to the end of the table.
    ensure!(last.1.matches('"').count() % 2 == 0, "line {}: unclosed quotation mark", last.0);
    rows.retain(|(_, fields)| fields.iter().any(|field| !field.trim().is_empty()));
    Ok(rows)
}
