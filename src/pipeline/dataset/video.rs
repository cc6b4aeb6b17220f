//! Input of the dataset for one video: the files of the earlier stages, and the samples cut from them.

use crate::sound;
use anyhow::{Context, Result, ensure};
use ndarray::{Axis, concatenate, s};
use orator_base::audio::fingerprint::Fingerprinter;
use orator_base::motion::posture::{self, LiftedBody};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::{Artifact, StageName, dir};
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::ledger::{Ledger, TranscriptReport};
use orator_base::stage::record::Record;
use orator_base::types::interval::{Interval, Intervals};
use orator_base::types::pose2d::Keypoints;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::skeleton::{L_HAND, N_HAND_JOINTS, R_HAND};
use orator_base::types::sound::{SAMPLE_RATE, Sound, SoundOffset, samples_of};
use orator_dataset::bones::VideoBones;
use orator_dataset::config::videos::slug;
use orator_dataset::decisions::{self, Decision, DecisionAction};
use orator_dataset::sample::Sample;
use orator_dataset::words::{self, VideoWords};
use orator_formats::media_json::MediaInfo;
use orator_formats::{joints_npz, sound_offset_json};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// A video that passed all stages.
pub struct LiftedVideo {
    /// `<slug of the file name>-<8 hex digits of the content hash>`: prefix of its sample keys.
    pub name: String,
    pub file: String,
    /// BLAKE3 of the video file.
    pub content: String,
    /// BLAKE3 of the hashes of all files that its samples depend on.
    pub files_hash: String,
    pub intervals: Intervals,
    pub ledger: Ledger,
    pub bones: VideoBones,
    /// Unit of the video in the stages.
    pub unit: Unit,
    /// Number of samples by which the audio is read later than the frames.
    shift: i64,
    /// Time of the first frame in the file, on whose clock transcripts are, seconds.
    first_image_secs: f64,
    sound: PathBuf,
    keypoints: PathBuf,
    joints: PathBuf,
    /// Words of the transcript; `None` if no transcripts are configured.
    pub words: Option<VideoWords>,
    /// Whether samples contain the angles of head and trunk.
    has_posture: bool,
    /// Decisions of users on hands and words.
    decisions: Vec<Decision>,
}

/// Version of the estimator of head and trunk angles, for fingerprints.
pub const POSTURE_VERSION: u32 = 1;

/// Files read for each video, and whether each is optional.
pub const FILES: [(Artifact, bool); 6] = [
    (Artifact::Sound, true),
    (Artifact::Keypoints, false),
    (Artifact::LiftIntervals, false),
    (Artifact::LiftLedger, false),
    (Artifact::Joints, false),
    (Artifact::Bones, false),
];

/// A sample, and the silence appended to its audio in seconds.
pub struct CutSample {
    pub sample: Sample,
    pub padded_secs: f64,
}

/// Audio samples per read.
const CHUNK_SAMPLES: usize = 1 << 15;

/// BLAKE3 of an output file of a stage, from its record if possible.
fn output_hash(file: Artifact, work: &Path, unit: &Unit) -> Result<String> {
    let record = Record::read(&dir(work, file.stage(), unit));
    let recorded = record.and_then(|record| record.outputs.into_iter().find(|output| output.file == file.file()));
    recorded.map_or_else(|| hash_file(&file.path(work, unit)), |output| Ok(output.hash))
}

impl LiftedVideo {
    /// Reads the small files; hashes come from the records of the stages where possible. `fixes_offset`: correct a
    /// reliably measured audio offset.
    ///
    /// # Errors
    /// A file that cannot be read; intervals that are unsorted or outside the video.
    pub fn open(work: &Path, unit: &Unit, fixes_offset: bool) -> Result<LiftedVideo> {
        let path_of = |file: Artifact| file.path(work, unit);
        let extracted = Record::read(&dir(work, StageName::Extract, unit));
        let content = match extracted.and_then(|record| record.fingerprint.inputs.get("video").cloned()) {
            Some(content) => content,
            None => hash_file(&unit.source)?,
        };
        let mut hasher = blake3::Hasher::new();
        for (file, optional) in FILES {
            if !optional || path_of(file).exists() {
                let line = format!("{} {} {}\n", file.stage(), file.file(), output_hash(file, work, unit)?);
                hasher.update(line.as_bytes());
            }
        }
        let offset = if fixes_offset { sound_offset_json::read(&path_of(Artifact::SoundOffset))? } else { None };
        let shift =
            offset.filter(SoundOffset::is_reliable).map_or(0, |o| (o.secs * f64::from(SAMPLE_RATE)).round() as i64);
        if shift != 0 {
            hasher.update(format!("sound shifted by {shift} samples\n").as_bytes());
        }
        let stem = unit.source.file_stem().unwrap_or_default().to_string_lossy();
        let path = path_of(Artifact::LiftIntervals);
        let intervals = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let intervals: Intervals = serde_json::from_slice(&intervals)
            .with_context(|| format!("{} is not a list of intervals: run the stage lift again", path.display()))?;
        for pair in intervals.intervals.windows(2) {
            ensure!(pair[0].end <= pair[1].start, "{}: its intervals are not in order", path.display());
        }
        let inside = |interval: &Interval| interval.start < interval.end && interval.end <= intervals.n_frames;
        ensure!(intervals.intervals.iter().all(inside), "{}: an interval outside the video", path.display());
        Ok(LiftedVideo {
            name: format!("{}-{}", slug(&stem), content.get(..8).unwrap_or(&content)),
            file: unit.source.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            files_hash: hasher.finalize().to_hex().to_string(),
            ledger: Ledger::read(&path_of(Artifact::LiftLedger))?,
            unit: unit.clone(),
            bones: VideoBones::read(&path_of(Artifact::Bones))?,
            shift,
            first_image_secs: MediaInfo::read(&path_of(Artifact::MediaInfo))
                .map_or(0.0, |media| media.first_image_secs),
            sound: path_of(Artifact::Sound),
            keypoints: path_of(Artifact::Keypoints),
            joints: path_of(Artifact::Joints),
            content,
            intervals,
            words: None,
            has_posture: false,
            decisions: Vec::new(),
        })
    }

    /// Applies the decisions of users among `all` on the hands, and on the words of a later `with_words`.
    pub fn with_decisions(mut self, all: &[Decision]) -> Self {
        let applied = decisions::of_unit(all, &self.unit, &[DecisionAction::SwapHands, DecisionAction::Word]);
        if !applied.is_empty() {
            let mut inputs = serde_json::json!({});
            decisions::record(&applied, &mut inputs);
            let inputs = format!("{} {inputs}\n", self.files_hash);
            self.files_hash = blake3::hash(inputs.as_bytes()).to_hex().to_string();
        }
        self.decisions = applied.into_iter().cloned().collect();
        self
    }

    /// Adds the words of the first usable one of the files `transcripts`; may be empty.
    pub fn with_words(mut self, transcripts: &[PathBuf]) -> Self {
        let n_samples = hound::WavReader::open(&self.sound).map_or(0.0, |wav| f64::from(wav.duration()));
        let rate = f64::from(SAMPLE_RATE);
        let described = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            format!("{name} {}", hash_file(path).unwrap_or_default())
        };
        let files: Vec<String> = transcripts.iter().map(described).collect();
        let files = if files.is_empty() { " ".to_owned() } else { files.join("\n") };
        let first = self.first_image_secs;
        let moved = if first > 0.0 { format!(" from {first} s") } else { String::new() };
        self.files_hash =
            blake3::hash(format!("{} words {files}{moved}\n", self.files_hash).as_bytes()).to_hex().to_string();
        let end_secs = first + n_samples / rate;
        let choice = words::choose(transcripts, &self.unit.speaker, end_secs);
        let words = VideoWords::of(choice, transcripts, end_secs, first + self.shift as f64 / rate);
        self.words = Some(words.corrected(&self.decisions.iter().collect::<Vec<_>>()));
        self
    }

    /// Adds the angles of head and trunk to the samples.
    pub fn with_posture(mut self) -> Self {
        let inputs = format!("{} posture {POSTURE_VERSION}\n", self.files_hash);
        self.files_hash = blake3::hash(inputs.as_bytes()).to_hex().to_string();
        self.has_posture = true;
        self
    }

    /// Statistics of the words in samples of these intervals.
    pub fn transcript_stats(&self, intervals: impl Iterator<Item = Interval>) -> Option<TranscriptReport> {
        let fps = self.intervals.fps;
        self.words.as_ref().map(|words| words.report(intervals.map(|i| (fps.secs(i.start), fps.secs(i.end)))))
    }

    /// Audio fingerprint codes (`audio::fingerprint`); `None` without audio. Memory: the codes, 0.45 MB per hour.
    pub fn sound_codes(&self) -> Result<Option<Vec<u32>>> {
        if !self.sound.exists() {
            return Ok(None);
        }
        let mut fingerprinter = Fingerprinter::default();
        sound::pieces(&self.sound, CHUNK_SAMPLES, |piece| {
            fingerprinter.push(piece);
            Ok(())
        })?;
        Ok(Some(fingerprinter.finish()))
    }

    /// Opens the large files to cut samples of `intervals`, which lie within the video's own.
    ///
    /// # Errors
    /// A file that cannot be read or has another number of frames or audio format.
    pub fn samples<'a>(&'a self, intervals: &'a [Interval]) -> Result<Option<LiftedSamples<'a>>> {
        if intervals.is_empty() {
            return Ok(None);
        }
        let swaps = decisions::of_unit(&self.decisions, &self.unit, &[DecisionAction::SwapHands]);
        let keypoints = decisions::read_keypoints(&self.keypoints, &swaps)?;
        let motion = joints_npz::read(&self.joints)?;
        let n_frames = self.intervals.n_frames;
        for (n, path) in [(keypoints.n_frames(), &self.keypoints), (motion.n_frames(), &self.joints)] {
            ensure!(
                n == n_frames,
                "{} has {n} frames, the video {n_frames}: run the stage that wrote it again",
                path.display()
            );
        }
        let sound =
            hound::WavReader::open(&self.sound).with_context(|| format!("cannot read {}", self.sound.display()))?;
        let spec = sound.spec();
        ensure!(
            (spec.sample_rate, spec.channels, spec.bits_per_sample) == (SAMPLE_RATE, 1, 16),
            "{} is not 16-bit mono at {SAMPLE_RATE} Hz: run the stage extract again",
            self.sound.display()
        );
        let extra = if self.has_posture { joints_npz::read_extra(&self.joints)? } else { None };
        let posture = self.has_posture.then(|| {
            let lifted =
                LiftedBody { joints: Some(motion.joints.view()), extra: extra.as_ref().map(|extra| extra.view()) };
            posture::estimate(keypoints.body.view(), lifted)
        });
        Ok(Some(LiftedSamples { video: self, keypoints, motion, posture, sound, remaining: intervals.iter() }))
    }
}

pub struct LiftedSamples<'a> {
    video: &'a LiftedVideo,
    keypoints: Keypoints,
    motion: Motion,
    posture: Option<Posture>,
    sound: hound::WavReader<BufReader<File>>,
    remaining: std::slice::Iter<'a, Interval>,
}

impl LiftedSamples<'_> {
    /// Sample of the next interval; `None` after the last.
    pub fn next_sample(&mut self) -> Result<Option<CutSample>> {
        self.remaining.next().map(|interval| self.cut(*interval)).transpose()
    }

    fn cut(&mut self, interval: Interval) -> Result<CutSample> {
        let (fps, frames) = (self.video.intervals.fps, s![interval.start..interval.end, .., ..]);
        let motion = Motion {
            fps,
            joints: self.motion.joints.slice(frames).to_owned(),
            mask: self.motion.mask.slice(s![interval.start..interval.end, ..]).to_owned(),
        };
        let points = [&self.keypoints.body, &self.keypoints.left_hand, &self.keypoints.right_hand];
        let points = points.map(|part| part.slice(frames));
        let pose2d = concatenate(Axis(1), &points).context("cannot join the keypoints")?;
        let (sound, n_padded) = self.sound_of(interval)?;
        let visible_share = |root: usize| {
            let hand = motion.mask.slice(s![.., root..root + N_HAND_JOINTS]);
            hand.iter().filter(|&&visible| visible).count() as f64 / hand.len().max(1) as f64
        };
        let mut meta = serde_json::json!({
            "video": self.video.name,
            "first_frame": interval.start,
            "n_frames": interval.n_frames(),
            "fps": fps,
            "start_secs": fps.secs(interval.start),
            "end_secs": fps.secs(interval.end),
            "image_size": self.keypoints.image_size,
            "left_hand_seen": visible_share(L_HAND),
            "right_hand_seen": visible_share(R_HAND),
            "sound_samples_padded": n_padded,
        });
        if self.video.shift != 0
            && let Some(meta) = meta.as_object_mut()
        {
            meta.insert("sound_shift_samples".to_owned(), self.video.shift.into());
        }
        let key = format!("{}-{:06}", self.video.name, interval.start);
        let padded_secs = n_padded as f64 / f64::from(SAMPLE_RATE);
        let words =
            self.video.words.as_ref().map(|words| words.within(fps.secs(interval.start), fps.secs(interval.end)));
        let posture = self.posture.as_ref().map(|posture| posture.slice(interval.start..interval.end));
        let sample = Sample { key, motion, pose2d, sound, words, posture, interlocutor: None, meta };
        Ok(CutSample { sample, padded_secs })
    }

    /// Audio of an interval, and the number of missing samples that are replaced by silence.
    fn sound_of(&mut self, interval: Interval) -> Result<(Sound, usize)> {
        let reading = || format!("cannot read {}", self.video.sound.display());
        let range = samples_of(self.video.intervals.fps, SAMPLE_RATE, interval.start..interval.end);
        let n_available = i64::from(self.sound.duration());
        let [start, end] = [range.start, range.end].map(|at| (at as i64 + self.video.shift).clamp(0, n_available));
        // Silence where the shifted audio begins after the interval does.
        let n_before = (-(range.start as i64 + self.video.shift)).clamp(0, range.len() as i64) as usize;
        let mut samples = vec![0.0; n_before];
        samples.reserve(range.len());
        if start < end {
            self.sound.seek(start as u32).with_context(reading)?;
            for sample in self.sound.samples::<i16>().take((end - start) as usize) {
                samples.push(f32::from(sample.with_context(reading)?) / 32_768.0);
            }
        }
        let n_padded = range.len() - samples.len() + n_before;
        samples.resize(range.len(), 0.0);
        Ok((Sound { rate: SAMPLE_RATE, samples }, n_padded))
    }
}
