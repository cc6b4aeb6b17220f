//! A folder of motion captures: `NAME.bvh` with its sound `NAME.wav`, and optionally a transcript with the same stem.

use super::segments::{PoseSequence, SequenceSplits};
use crate::generate::seq2seq::architecture;
use anyhow::{Context, Result, bail, ensure};
use ndarray::{Array2, s};
use orator_base::audio::mfcc;
use orator_base::stage::fingerprint::hash_file;
use orator_base::types::sound::Sound;
use orator_formats::bvh::exponential_maps::{ExponentialMaps, FPS, JointMapping};
use orator_formats::bvh::read::Bvh;
use orator_formats::search::NamedFiles;
use orator_formats::transcript::{ENDINGS, TranscriptChoice, after_end};
use orator_media::ffmpeg::{audio, probe};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Folder of motion captures, some of which are held out for validation.
#[derive(Clone, Debug)]
pub struct CaptureFolder {
    dir: PathBuf,
    /// Sample rate of the network's audio, Hz: that of the first capture, clamped to the supported range.
    pub rate: u32,
    mapping: JointMapping,
    captures: Vec<Capture>,
}

#[derive(Clone, Debug)]
struct Capture {
    bvh: PathBuf,
    wav: PathBuf,
    transcript: TranscriptChoice,
    is_held_out: bool,
}

impl CaptureFolder {
    /// Lists a folder. `hold_out`: names (without extension) of the captures to validate on.
    ///
    /// # Errors
    /// Motion without sound, sound without motion, no capture, none left to train on, an unknown held-out name.
    pub fn open(dir: &Path, hold_out: &[String], mapping: JointMapping) -> Result<Self> {
        let entries = std::fs::read_dir(dir).with_context(|| format!("cannot list {}", dir.display()))?;
        let paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<PathBuf>>>()?;
        let of_kind = |kind: &'static str| paths.iter().filter(move |path| has_ending(path, kind));
        let mut named = NamedFiles::default();
        let mut beside = |path: &Path, endings: &[&str]| named.find(dir, &[&stem(path)], endings);
        if let Some(wav) = of_kind("wav").find(|wav| beside(wav, &["bvh"]).is_empty()) {
            bail!("{} has no motion: {} does not exist", wav.display(), wav.with_extension("bvh").display());
        }
        let capture = |bvh: &PathBuf| -> Result<Capture> {
            let wav = beside(bvh, &["wav"]).into_iter().next().with_context(|| {
                format!("{} has no audio: {} does not exist", bvh.display(), bvh.with_extension("wav").display())
            })?;
            let transcript = TranscriptChoice::first(&beside(bvh, &ENDINGS), "", |_, _| Ok(()));
            let is_held_out = hold_out.contains(&stem(bvh));
            Ok(Capture { bvh: bvh.clone(), wav, transcript, is_held_out })
        };
        let mut captures = of_kind("bvh").map(capture).collect::<Result<Vec<Capture>>>()?;
        captures.sort_by(|a, b| a.bvh.cmp(&b.bvh));
        let first = captures
            .first()
            .with_context(|| format!("no captures in {}: expected NAME.bvh with NAME.wav", dir.display()))?;
        if let Some(name) = hold_out.iter().find(|name| !captures.iter().any(|capture| stem(&capture.bvh) == **name)) {
            bail!("cannot hold out {}: {} has no {name}.bvh", name, dir.display());
        }
        ensure!(
            captures.iter().any(|capture| !capture.is_held_out),
            "{}: all captures are held out, and none remains to train on",
            dir.display()
        );
        let rate = probe::probe(&first.wav)?.audio.map_or(0, |audio| audio.rate);
        let rate = rate.clamp(*architecture::RATES.start(), *architecture::RATES.end());
        Ok(Self { dir: dir.to_owned(), rate, mapping, captures })
    }

    pub fn name(&self) -> String {
        let dir = self.dir.canonicalize().unwrap_or_else(|_| self.dir.clone());
        dir.file_name().map_or_else(|| "captures".to_owned(), |name| name.to_string_lossy().into_owned())
    }

    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Hash of the names and contents of all files, and of which of them are held out.
    pub fn hash(&self) -> Result<String> {
        let line = |capture: &Capture| -> Result<String> {
            let transcript = capture.transcript.found.as_ref().map(|(path, _)| path);
            let files = [Some(&capture.bvh), Some(&capture.wav), transcript].into_iter().flatten();
            let line = |path: &PathBuf| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                Ok(format!("{name} {} {}\n", hash_file(path)?, capture.is_held_out))
            };
            files.map(line).collect()
        };
        let lines = self.captures.par_iter().map(line).collect::<Result<String>>()?;
        Ok(blake3::hash(lines.as_bytes()).to_hex().to_string())
    }

    /// Mapping from motion to exponential map features, fitted to the captures that are trained on.
    pub fn exponential_maps(&self) -> Result<ExponentialMaps> {
        let trained = self.captures.iter().filter(|capture| !capture.is_held_out);
        let read = |capture: &Capture| Ok((capture.bvh.display().to_string(), Bvh::read(&capture.bvh)?));
        ExponentialMaps::of(trained.map(read), &self.mapping)
    }

    /// All captures as sequences, with audio features for contexts of `context` frames.
    pub fn sequences(&self, maps: &ExponentialMaps, context: usize) -> Result<SequenceSplits> {
        let read = |capture: &Capture| Ok((capture.is_held_out, self.sequence(capture, maps, context)?));
        let all = self.captures.par_iter().map(read).collect::<Result<Vec<_>>>()?;
        let (held_out, train): (Vec<_>, Vec<_>) = all.into_iter().partition(|(is_held_out, _)| *is_held_out);
        let mut notes = Vec::new();
        let mut without_notes = |part: Vec<(bool, (PoseSequence, Vec<String>))>| {
            let (part, of_files): (Vec<_>, Vec<_>) = part.into_iter().map(|(_, sequence)| sequence).unzip();
            notes.extend(of_files.concat());
            part
        };
        let (train, held_out) = (without_notes(train), without_notes(held_out));
        Ok(SequenceSplits { train, held_out, notes })
    }

    fn sequence(
        &self,
        capture: &Capture,
        maps: &ExponentialMaps,
        context: usize,
    ) -> Result<(PoseSequence, Vec<String>)> {
        let bvh = Bvh::read(&capture.bvh)?;
        let poses = maps.features(&bvh).with_context(|| capture.bvh.display().to_string())?;
        let sound = read_sound(&capture.wav, self.rate)?;
        let n = poses.nrows().min(mfcc::n_poses(sound.samples.len(), sound.rate, FPS.per_sec()));
        let audio = architecture::audio_features(&sound, FPS, n, n, context);
        let TranscriptChoice { found, mut notes, .. } = capture.transcript.clone();
        let words = found.map_or_else(Vec::new, |(path, transcript)| {
            let named = |note: String| format!("{}: {note}", path.display());
            let after_end = after_end(&transcript.words, sound.secs());
            notes.extend(transcript.notes.into_iter().chain(after_end).map(named));
            transcript.words
        });
        let of_bvh = bvh.notes.iter().map(|note| format!("{}: {note}", capture.bvh.display()));
        let notes = of_bvh.chain(notes).collect();
        let poses = poses.slice(s![..n, ..]).to_owned();
        Ok((PoseSequence::new(poses, Array2::from_elem((n, maps.n_columns()), true), audio, words), notes))
    }
}

fn read_sound(path: &Path, rate: u32) -> Result<Sound> {
    audio::read_mono(path, rate)?.with_context(|| format!("{} has no audio", path.display()))
}

fn has_ending(path: &Path, kind: &str) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(kind))
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
