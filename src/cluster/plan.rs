//! A sealed plan: the units, and the program, configuration and models that process them. Workers on any machine check
//! that theirs are identical before they claim a unit.

use super::job::shell;
use super::sealed_input::SealedInput;
use anyhow::{Context, Result, bail, ensure};
use orator_base::stage::fingerprint::{HashCache, hash_file};
use orator_base::stage::progress::Progress;
use orator_base::stage::{Unit, workdir};
use orator_base::types::device::DeviceChoice;
use orator_dataset::config::videos::Videos;
use orator_dataset::config::{Config, GanConfig, Seq2seqConfig};
use orator_dataset::decisions;
use orator_pipeline::Pipeline;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

/// Version of the file format; a file of any other version is rejected.
const VERSION: u32 = 3;
/// Default length of a part of a long video, seconds.
pub const PART_SECS: f64 = 600.0;
/// Videos of at least this many parts are split among several workers.
const MIN_SPLIT_PARTS: f64 = 1.5;
/// Upper bound of the length of a video, seconds.
const LONGEST_SECS: f64 = 1e9;

/// The units to process and what they depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClusterPlan {
    pub version: u32,
    /// BLAKE3 of the program.
    pub program: String,
    /// Path of the configuration; `settings` is the BLAKE3 of its settings.
    pub config: PathBuf,
    /// `--set` overrides of the configuration.
    pub sets: Vec<String>,
    pub settings: String,
    /// BLAKE3 of every weight file, by file name.
    pub models: BTreeMap<String, String>,
    /// The units in the order in which workers claim them: the longest first.
    pub units: Vec<PlannedUnit>,
    /// BLAKE3 of all other fields.
    pub seal: String,
}

/// A video to process, or a part of the work on a long one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedUnit {
    pub speaker: String,
    /// Name of the video in the work folder.
    pub video: String,
    pub source: PathBuf,
    /// Files that the first stage reads.
    pub inputs: Vec<SealedInput>,
    /// Duration of the video, seconds, if it could be read.
    pub secs: Option<f64>,
    /// Part of the work on the video that this unit does.
    pub share: UnitShare,
    /// Indices of the units that must have ended before this one starts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub needs: Vec<usize>,
}

/// Part of the work on a video that a unit does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UnitShare {
    /// All stages, as far as they are not up to date.
    #[serde(rename = "whole")]
    AllStages,
    /// The first stage only.
    Extract,
    /// Part `idx` of `of` of the stages that can be split.
    Parts { idx: usize, of: usize },
}

impl PlannedUnit {
    pub fn unit(&self) -> Unit {
        Unit { speaker: self.speaker.clone(), video: self.video.clone(), source: self.source.clone() }
    }

    /// Checks the input files.
    ///
    /// # Errors
    /// A file has changed since the plan was written, or cannot be read.
    pub fn check_inputs(&self, hashes: &HashCache) -> Result<()> {
        self.inputs.iter().try_for_each(|input| input.check(hashes))
    }

    /// Seconds of video that count as processed when this unit has ended, if the duration is known.
    pub fn media_secs(&self) -> Option<f64> {
        match self.share {
            UnitShare::AllStages if self.needs.is_empty() => self.secs,
            UnitShare::Parts { of, .. } => self.secs.map(|secs| secs / of as f64),
            UnitShare::AllStages | UnitShare::Extract => Some(0.0),
        }
    }

    /// Splits a long video into units with parts of about `part_secs` seconds; `needs` holds indices into the result.
    fn split(self, part_secs: f64) -> Vec<Self> {
        let secs = self.secs.unwrap_or(0.0);
        if secs < MIN_SPLIT_PARTS * part_secs {
            return vec![self];
        }
        let of = (secs / part_secs).round().max(2.0) as usize;
        let first = Self { share: UnitShare::Extract, ..self.clone() };
        let parts = (0..of).map(|idx| Self { share: UnitShare::Parts { idx, of }, needs: vec![0], ..self.clone() });
        let final_unit = Self { needs: (1..=of).collect(), ..self.clone() };
        std::iter::once(first).chain(parts).chain([final_unit]).collect()
    }
}

impl fmt::Display for PlannedUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.share {
            UnitShare::AllStages => write!(f, "{}", self.unit()),
            UnitShare::Extract => write!(f, "{} (extract)", self.unit()),
            UnitShare::Parts { idx, of } => write!(f, "{} (part {} of {of})", self.unit(), idx + 1),
        }
    }
}

/// Splits the videos and sorts the units: units that others depend on first, then by length, longest first.
pub fn split_and_sort(videos: Vec<PlannedUnit>, part_secs: f64) -> Vec<PlannedUnit> {
    let mut units: Vec<PlannedUnit> = Vec::new();
    for video in videos {
        let n_before = units.len();
        units.extend(video.split(part_secs).into_iter().map(|mut unit| {
            unit.needs.iter_mut().for_each(|needed| *needed += n_before);
            unit
        }));
    }
    let rank = |unit: &PlannedUnit| match unit.share {
        UnitShare::Extract => unit.secs.unwrap_or(0.0) + LONGEST_SECS,
        _ => unit.media_secs().unwrap_or(0.0),
    };
    let mut order: Vec<usize> = (0..units.len()).collect();
    // The sort is stable: the parts of a video stay in order.
    order.sort_by(|a, b| rank(&units[*b]).total_cmp(&rank(&units[*a])));
    let mut number_of = vec![0; units.len()];
    order.iter().enumerate().for_each(|(number, at)| number_of[*at] = number);
    let numbered = |at: &usize| {
        let needs = units[*at].needs.iter().map(|needed| number_of[*needed]).collect();
        PlannedUnit { needs, ..units[*at].clone() }
    };
    order.iter().map(numbered).collect()
}

impl ClusterPlan {
    /// Creates the plan of all videos of a pipeline; videos whose hash is not cached are read completely. `secs`
    /// returns the duration of a video; long videos are split into parts of about `part_secs` seconds.
    ///
    /// # Errors
    /// The pipeline has no video, or a video, weight file or the program cannot be read.
    pub fn new(
        pipeline: &Pipeline,
        sets: &[String],
        program: &Path,
        secs: &dyn Fn(&Path) -> Option<f64>,
        part_secs: f64,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let videos: Vec<Unit> = pipeline.videos(&[])?.into_iter().flat_map(|videos| videos.units).collect();
        ensure!(
            !videos.is_empty(),
            "{} selects no existing video: check the paths of its [[speaker]] tables",
            pipeline.config().file.display()
        );
        let (hashes, inputs) = (pipeline.hashes(), pipeline.source_inputs(&videos)?);
        let task = progress.begin("hashing the videos", videos.len() as u64);
        let mut units = Vec::new();
        for (Unit { speaker, video, source }, inputs) in videos.into_iter().zip(inputs) {
            let sealed = inputs.into_iter().map(|input| SealedInput::new(input, &hashes)).collect::<Result<_>>();
            let inputs = sealed.with_context(|| format!("cannot hash the inputs of {speaker}/{video}"))?;
            // Rounded to milliseconds, which JSON reproduces exactly.
            let secs = secs(&source).map(|secs| (1000.0 * secs).round() / 1000.0);
            units.push(PlannedUnit {
                speaker,
                video,
                source,
                inputs,
                secs,
                share: UnitShare::AllStages,
                needs: Vec::new(),
            });
            hashes.save_periodically();
            task.advance(1);
        }
        hashes.save()?;
        units.sort_by(|a, b| (&a.speaker, &a.video).cmp(&(&b.speaker, &b.video)));
        let config = pipeline.config();
        let mut plan = Self {
            version: VERSION,
            program: hash_file(program)?,
            config: config.file.clone(),
            sets: sets.to_vec(),
            settings: settings_hash(config)?,
            models: pipeline.model_hashes()?,
            units: split_and_sort(units, part_secs),
            seal: String::new(),
        };
        plan.seal = plan.compute_seal()?;
        Ok(plan)
    }

    /// Reads a plan.
    ///
    /// # Errors
    /// The file is not a plan, has another version, or was changed after it was written.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = workdir::read_file(path)
            .with_context(|| format!("cannot read the plan {} (create one with `orator plan`)", path.display()))?;
        let invalid_plan = || format!("{} is not a plan: expected a file written by `orator plan`", path.display());
        let known: serde_json::Value = serde_json::from_slice(&bytes).with_context(invalid_plan)?;
        let advice = "create it again with `orator plan`";
        if let Some(version) = known["version"].as_u64().filter(|version| *version != u64::from(VERSION)) {
            bail!("{} has plan version {version}, expected {VERSION}: {advice}", path.display());
        }
        let plan: Self = serde_json::from_value(known).with_context(invalid_plan)?;
        let path = path.display();
        ensure!(plan.seal == plan.compute_seal()?, "{path} was edited after `orator plan` wrote it: {advice}");
        Ok(plan)
    }

    /// Writes the plan. Results of workers under an earlier plan at this path do not count for it.
    pub fn write(&self, path: &Path) -> Result<()> {
        let mut bytes = serde_json::to_vec_pretty(self)?;
        bytes.push(b'\n');
        workdir::write_file(path, &bytes)
    }

    /// The folder that the workers share: next to the plan, named after the plan and its seal.
    pub fn folder(&self, path: &Path) -> PathBuf {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        path.with_file_name(format!("{stem}-{}", &self.seal[..12]))
    }

    pub fn videos(&self) -> Vec<PlannedUnit> {
        self.units.iter().filter(|unit| unit.share == UnitShare::AllStages).cloned().collect()
    }

    /// Names of the speakers, sorted.
    pub fn speakers(&self) -> Vec<&str> {
        let names: BTreeSet<&str> = self.units.iter().map(|unit| unit.speaker.as_str()).collect();
        names.into_iter().collect()
    }

    /// Command line with which `program` builds the datasets after all units have ended.
    pub fn datasets_command(&self, program: &str) -> String {
        format!("{} --only dataset", self.command(program, &["run"]))
    }

    /// Command line with which `program` trains a model; the caller appends the speaker's name.
    pub fn training_command(&self, program: &str) -> String {
        format!("{} --speaker", self.command(program, &["train", "gan"]))
    }

    /// A command line of `program` with the configuration and overrides of the plan.
    fn command(&self, program: &str, verb: &[&str]) -> String {
        let mut words = vec![program.to_owned()];
        words.extend(verb.iter().map(|&word| word.to_owned()));
        words.extend(["-c".to_owned(), self.config.display().to_string()]);
        words.extend(self.sets.iter().flat_map(|set| ["--set".to_owned(), set.clone()]));
        shell(&words)
    }

    /// Checks that the program, its configuration and its models are those of the plan.
    ///
    /// # Errors
    /// What differs, and what to do.
    pub fn check(&self, pipeline: &Pipeline, program: &Path) -> Result<()> {
        let advice = "create the plan again with `orator plan`";
        if hash_file(program)? != self.program {
            bail!("this program differs from the one of the plan: use one version on all machines, or {advice}");
        }
        if settings_hash(pipeline.config())? != self.settings {
            bail!("{} changed since the plan was written: {advice}", self.config.display());
        }
        let models = pipeline.model_hashes()?;
        if let Some((name, _)) = self.models.iter().find(|(name, hash)| models.get(*name) != Some(hash)) {
            bail!("the model {name} differs from the one of the plan: use one version on all machines, or {advice}");
        }
        match self.missing(pipeline)?.first() {
            Some(unit) => bail!("the video {} of the plan was not found: {advice}", unit.source.display()),
            None => Ok(()),
        }
    }

    /// Videos of the plan that the pipeline does not find.
    fn missing(&self, pipeline: &Pipeline) -> Result<Vec<PlannedUnit>> {
        let videos = pipeline.videos(&[])?;
        let is_known = |unit: &PlannedUnit| videos.iter().any(|videos| has(videos, unit));
        Ok(self.videos().into_iter().filter(|unit| !is_known(unit)).collect())
    }

    /// Videos of the plan at `path` that the pipeline does not find; empty if `path` is not a plan with these settings.
    pub fn missing_videos(path: &Path, pipeline: &Pipeline) -> Result<Vec<PlannedUnit>> {
        match Self::read(path) {
            Ok(plan) if plan.settings == settings_hash(pipeline.config())? => plan.missing(pipeline),
            _ => Ok(Vec::new()),
        }
    }

    /// BLAKE3 of the plan with an empty seal.
    fn compute_seal(&self) -> Result<String> {
        let unsealed = Self { seal: String::new(), ..self.clone() };
        Ok(blake3::hash(&serde_json::to_vec(&unsealed)?).to_hex().to_string())
    }
}

fn has(videos: &Videos, unit: &PlannedUnit) -> bool {
    videos.speaker == unit.speaker && videos.units.iter().any(|known| known.video == unit.video)
}

/// BLAKE3 of the settings that affect videos and datasets. Training comes after the plan, and the number of parallel
/// jobs does not change results.
pub fn settings_hash(config: &Config) -> Result<String> {
    let mut settings = config.settings.clone();
    (settings.work.jobs, settings.work.device) = (0, DeviceChoice::default());
    settings.gan = GanConfig::default();
    settings.seq2seq = Seq2seqConfig::default();
    let mut bytes = serde_json::to_vec(&settings)?;
    let (decisions, mut recorded) = (decisions::read(&config.file)?, serde_json::json!({}));
    decisions::record(&decisions.iter().collect::<Vec<_>>(), &mut recorded);
    if !decisions.is_empty() {
        bytes.extend(recorded.to_string().as_bytes());
    }
    Ok(blake3::hash(&bytes).to_hex().to_string())
}
