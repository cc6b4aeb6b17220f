//! Speech of a speaker: intervals of a dataset, or sound files. Data are read on demand and not cached.

use anyhow::{Context, Result, bail, ensure};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::sound::Sound;
use orator_base::types::split::Split;
use orator_base::types::time::FrameRate;
use orator_dataset::Dataset;
use orator_dataset::config::patterns::{SOUND_EXTENSIONS, SearchRoot, TRANSCRIPT_EXTENSIONS, expand};
use orator_dataset::index::SampleRef;
use orator_formats::search::NamedFiles;
use orator_formats::transcript::{Transcript, Word};
use orator_media::ffmpeg::audio;
use std::path::{Path, PathBuf};

pub struct SpeakerSource {
    pub name: String,
    pub fps: FrameRate,
    /// Bone lengths of the speaker, metres, 0 if unknown; empty without a dataset.
    pub bone_lengths: Vec<f32>,
    pub dataset: Option<Dataset>,
    segments: Vec<SourceSegment>,
}

struct SourceSegment {
    name: String,
    location: SegmentLocation,
}

enum SegmentLocation {
    Sample(Box<SampleRef>),
    File(PathBuf),
}

pub struct SpeechSegment {
    /// Name, unique for the speaker.
    pub name: String,
    pub sound: Sound,
    /// Words with times relative to the start of the sound.
    pub words: Vec<Word>,
    pub n_frames: usize,
    pub natural: Option<(Motion, Option<Posture>)>,
}

impl SpeakerSource {
    /// Source with the intervals of a split of the dataset at `dir`.
    ///
    /// # Errors
    /// There is no dataset, or it has no interval in that split.
    pub fn of_dataset(name: &str, dir: &Path, split: Split) -> Result<Self> {
        let dataset = Dataset::open(dir)?;
        let samples = dataset.samples(split);
        if samples.is_empty() {
            let others = Split::ALL.into_iter().filter(|other| !dataset.samples(*other).is_empty());
            let others: Vec<&str> = others.map(Split::name).collect();
            let (dir, split) = (dataset.dir().display(), split.name());
            bail!(
                "{dir} has no interval in the {split} split: set `split` of the speaker {name} to one of {}",
                others.join(", ")
            );
        }
        let bone_lengths = dataset.info().bone_lengths_metres.iter().map(|metres| *metres as f32).collect();
        let segment = |sample: SampleRef| SourceSegment {
            name: sample.key.to_string(),
            location: SegmentLocation::Sample(Box::new(sample)),
        };
        let segments = samples.into_iter().map(segment).collect();
        Ok(Self { name: name.to_owned(), fps: dataset.info().fps, bone_lengths, dataset: Some(dataset), segments })
    }

    /// Source with the sound files that match `pattern` and the transcripts next to them, for motion at `fps`.
    ///
    /// # Errors
    /// No file matches, or two have the same name.
    pub fn of_sounds(name: &str, pattern: &Path, fps: FrameRate) -> Result<Self> {
        let (mut missing, entry) = (Vec::new(), pattern.to_string_lossy());
        let root = SearchRoot::new(Path::new("/"), &[]);
        let found = expand(&entry, &root, ("sound", &SOUND_EXTENSIONS), &mut missing).map_err(anyhow::Error::msg);
        let mut files = found.with_context(|| format!("audio files of the speaker {name}"))?;
        ensure!(missing.is_empty(), "audio files of the speaker {name}: {}", missing.join("; "));
        files.sort();
        let mut segments: Vec<SourceSegment> = Vec::new();
        for file in files {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let is_duplicate = segments.iter().any(|segment| segment.name == stem);
            ensure!(
                !is_duplicate,
                "{}: two audio files of the speaker {name} have the name {stem}: rename one",
                file.display()
            );
            segments.push(SourceSegment { name: stem, location: SegmentLocation::File(file) });
        }
        Ok(Self { name: name.to_owned(), fps, bone_lengths: Vec::new(), dataset: None, segments })
    }

    pub fn n_segments(&self) -> usize {
        self.segments.len()
    }

    pub fn read(&self, segment: usize) -> Result<SpeechSegment> {
        let SourceSegment { name, location } = &self.segments[segment];
        match (location, &self.dataset) {
            (SegmentLocation::Sample(sample), Some(dataset)) => {
                let sample = dataset.read(sample)?;
                let n_frames = sample.n_frames();
                Ok(SpeechSegment {
                    name: name.clone(),
                    sound: sample.sound,
                    words: sample.words.unwrap_or_default(),
                    n_frames,
                    natural: Some((sample.motion, sample.posture)),
                })
            }
            (SegmentLocation::File(file), _) => {
                let sound = audio::read_sound(file)?;
                let words = transcript_beside(file).map(|path| Transcript::read(&path)).transpose()?;
                let n_frames = (sound.secs() * self.fps.per_sec() + 1e-6) as usize;
                let words = words.map(|transcript| transcript.words).unwrap_or_default();
                Ok(SpeechSegment { name: name.clone(), sound, words, n_frames, natural: None })
            }
            (SegmentLocation::Sample(_), None) => bail!("{name}: the dataset is closed"),
        }
    }
}

/// Transcript with the sound's file name in the same folder.
fn transcript_beside(sound: &Path) -> Option<PathBuf> {
    let stem = sound.file_stem()?.to_str()?;
    NamedFiles::default().find(sound.parent()?, &[stem], &TRANSCRIPT_EXTENSIONS).into_iter().next()
}
