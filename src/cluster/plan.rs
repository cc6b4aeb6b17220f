//! A sealed plan: which units there are, and what they are made with. Workers on any machine check that they hold the same
//! program, configuration and models before they claim a unit.

use super::job::shell;
use super::sealed_input::SealedInput;
use anyhow::{Context, Result, bail, ensure};
use orator_base::stage::fingerprint::{HashCache, hash_file};
use orator_base::stage::progress::Progress;
use orator_base::stage::{Unit, workdir};
use orator_dataset::config::videos::Videos;
use orator_dataset::config::{Config, GanConfig, Seq2seqConfig};
use orator_pipeline::Pipeline;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

/// Meaning of the file; another one is refused.
const VERSION: u32 = 3;
/// Usual length of a piece of a long video, seconds.
pub const PIECE_SECS: f64 = 600.0;
/// Videos from so many pieces on are shared by several workers.
const LONG: f64 = 1.5;
/// No video is longer, seconds.
const LONGEST_SECS: f64 = 1e9;

/// What workers do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClusterPlan {
    /// Meaning of this file.
    pub version: u32,
    /// BLAKE3 of the program.
    pub program: String,
    /// The configuration, and BLAKE3 of its settings.
    pub config: PathBuf,
    /// `--set` changes of the configuration.
    pub sets: Vec<String>,
    pub settings: String,
    /// BLAKE3 of every file of weights, by its name.
    pub models: BTreeMap<String, String>,
    /// The units, in the order in which they are taken: the longest first.
    pub units: Vec<PlannedUnit>,
    /// BLAKE3 of all of the above.
    pub seal: String,
}

/// A video to be worked on, or what prepares the work on a long one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedUnit {
    pub speaker: String,
    /// Work name of the video.
    pub video: String,
    pub source: PathBuf,
    /// Files that its first stage reads.
    pub inputs: Vec<SealedInput>,
    /// Duration of the video, where it could be read.
    pub secs: Option<f64>,
    /// What is to be done of the video.
    pub share: UnitShare,
    /// Numbers of the units that must have ended before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub needs: Vec<usize>,
}

/// What a unit is of the work on a video.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UnitShare {
    /// All of it that is not done.
    Whole,
    /// The first stage.
    Extract,
    /// A share of the parts of the stages that have parts: number `idx` of `of`.
    Parts { idx: usize, of: usize },
}

impl PlannedUnit {
    /// The unit of the stages.
    pub fn unit(&self) -> Unit {
        Unit { speaker: self.speaker.clone(), video: self.video.clone(), source: self.source.clone() }
    }

    /// Errors where a file is not what it was when the plan was written.
    pub fn check_inputs(&self, hashes: &HashCache) -> Result<()> {
        self.inputs.iter().try_for_each(|input| input.check(hashes))
    }

    /// Seconds of video that have gone through when it has ended, where the length is known.
    pub fn media_secs(&self) -> Option<f64> {
        match self.share {
            UnitShare::Whole if self.needs.is_empty() => self.secs,
            UnitShare::Parts { of, .. } => self.secs.map(|secs| secs / of as f64),
            UnitShare::Whole | UnitShare::Extract => Some(0.0),
        }
    }

    /// The units of a video, each with the numbers among them that it needs; pieces of a long one are about `piece_secs`
    /// long.
    fn shared(self, piece_secs: f64) -> Vec<Self> {
        let secs = self.secs.unwrap_or(0.0);
        if secs < LONG * piece_secs {
            return vec![self];
        }
        let of = (secs / piece_secs).round().max(2.0) as usize;
        let first = Self { share: UnitShare::Extract, ..self.clone() };
        let parts = (0..of).map(|idx| Self { share: UnitShare::Parts { idx, of }, needs: vec![0], ..self.clone() });
        let whole = Self { needs: (1..=of).collect(), ..self.clone() };
        std::iter::once(first).chain(parts).chain([whole]).collect()
    }
}

impl fmt::Display for PlannedUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.share {
            UnitShare::Whole => write!(f, "{}", self.unit()),
            UnitShare::Extract => write!(f, "{} (extract)", self.unit()),
            UnitShare::Parts { idx, of } => write!(f, "{} (part {} of {of})", self.unit(), idx + 1),
        }
    }
}

/// Puts the units of videos in the order in which they are taken: what others wait for first, then the longest.
pub fn in_order(videos: Vec<PlannedUnit>, piece_secs: f64) -> Vec<PlannedUnit> {
    let mut units: Vec<PlannedUnit> = Vec::new();
    for video in videos {
        let n_before = units.len();
        units.extend(video.shared(piece_secs).into_iter().map(|mut unit| {
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
    /// The plan of all videos of a pipeline, which are read whole where their hashes are not known. `secs` gives the duration
    /// of a video; long ones are shared in pieces of about `piece_secs`.
    ///
    /// # Errors
    /// No video; videos, weights or a program that cannot be read.
    pub fn new(
        pipeline: &Pipeline,
        sets: &[String],
        program: &Path,
        secs: &dyn Fn(&Path) -> Option<f64>,
        piece_secs: f64,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let videos: Vec<Unit> = pipeline.videos(&[])?.into_iter().flat_map(|videos| videos.units).collect();
        ensure!(!videos.is_empty(), "{} names no video that is there", pipeline.config().file.display());
        let (hashes, inputs) = (pipeline.hashes(), pipeline.source_inputs(&videos)?);
        let task = progress.begin("hashing the videos", videos.len() as u64);
        let mut units = Vec::new();
        for (Unit { speaker, video, source }, inputs) in videos.into_iter().zip(inputs) {
            let sealed = inputs.into_iter().map(|input| SealedInput::new(input, &hashes)).collect::<Result<_>>();
            let inputs = sealed.with_context(|| format!("no plan without the content of {speaker}/{video}"))?;
            // To the millisecond, which comes back from the file as it is.
            let secs = secs(&source).map(|secs| (1000.0 * secs).round() / 1000.0);
            units.push(PlannedUnit {
                speaker,
                video,
                source,
                inputs,
                secs,
                share: UnitShare::Whole,
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
            units: in_order(units, piece_secs),
            seal: String::new(),
        };
        plan.seal = plan.sealed()?;
        Ok(plan)
    }

    /// Reads a plan.
    ///
    /// # Errors
    /// No plan, a plan of another version, or one that was changed since it was written.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = workdir::read_file(path)
            .with_context(|| format!("cannot read the plan {}; `orator plan` writes one", path.display()))?;
        let no_plan = || format!("{} is no plan", path.display());
        let known: serde_json::Value = serde_json::from_slice(&bytes).with_context(no_plan)?;
        let anew = "write it anew with `orator plan`";
        if let Some(version) = known["version"].as_u64().filter(|version| *version != u64::from(VERSION)) {
            bail!("{} is a plan of version {version}, expected {VERSION}: {anew}", path.display());
        }
        let plan: Self = serde_json::from_value(known).with_context(no_plan)?;
        let path = path.display();
        ensure!(plan.seal == plan.sealed()?, "{path} was changed since `orator plan` wrote it: write it anew");
        Ok(plan)
    }

    /// Writes the plan. What workers did by an earlier one in its place does not count for it.
    pub fn write(&self, path: &Path) -> Result<()> {
        let mut bytes = serde_json::to_vec_pretty(self)?;
        bytes.push(b'\n');
        workdir::write_file(path, &bytes)
    }

    /// The folder where workers meet: beside the plan, of its name and seal.
    pub fn folder(&self, path: &Path) -> PathBuf {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        path.with_file_name(format!("{stem}-{}", &self.seal[..12]))
    }

    /// The videos, one unit each.
    pub fn videos(&self) -> Vec<PlannedUnit> {
        self.units.iter().filter(|unit| unit.share == UnitShare::Whole).cloned().collect()
    }

    /// Names of the speakers, sorted.
    pub fn speakers(&self) -> Vec<&str> {
        let names: BTreeSet<&str> = self.units.iter().map(|unit| unit.speaker.as_str()).collect();
        names.into_iter().collect()
    }

    /// The command line by which `program` makes the datasets when all units have ended.
    pub fn datasets_command(&self, program: &str) -> String {
        format!("{} --only dataset", self.command(program, &["run"]))
    }

    /// The command line by which `program` trains a model; the speaker's name comes behind it.
    pub fn training_command(&self, program: &str) -> String {
        format!("{} --speaker", self.command(program, &["train", "gan"]))
    }

    /// A command line of `program` with the configuration of the plan.
    fn command(&self, program: &str, verb: &[&str]) -> String {
        let mut words = vec![program.to_owned()];
        words.extend(verb.iter().map(|&word| word.to_owned()));
        words.extend(["-c".to_owned(), self.config.display().to_string()]);
        words.extend(self.sets.iter().flat_map(|set| ["--set".to_owned(), set.clone()]));
        shell(&words)
    }

    /// Errors where this program, its configuration or its models are not those of the plan.
    ///
    /// # Errors
    /// What differs, and what to do.
    pub fn check(&self, pipeline: &Pipeline, program: &Path) -> Result<()> {
        let anew = "write the plan anew with `orator plan`";
        if hash_file(program)? != self.program {
            bail!("this program is not the one that wrote the plan: use the same on every machine, or {anew}");
        }
        if settings_hash(pipeline.config())? != self.settings {
            bail!("{} changed since the plan was written: {anew}", self.config.display());
        }
        let models = pipeline.model_hashes()?;
        if let Some((name, _)) = self.models.iter().find(|(name, hash)| models.get(*name) != Some(hash)) {
            bail!("the model {name} is not the one of the plan: copy the same models to every machine, or {anew}");
        }
        match self.missing(pipeline)?.first() {
            Some(unit) => bail!("the video {} of the plan is not found here: {anew}", unit.source.display()),
            None => Ok(()),
        }
    }

    /// Videos of the plan that the pipeline does not find.
    fn missing(&self, pipeline: &Pipeline) -> Result<Vec<PlannedUnit>> {
        let videos = pipeline.videos(&[])?;
        let is_known = |unit: &PlannedUnit| videos.iter().any(|videos| has(videos, unit));
        Ok(self.videos().into_iter().filter(|unit| !is_known(unit)).collect())
    }

    /// Videos of the plan at `path` that the pipeline does not find; none where there is no plan of these settings.
    ///
    /// # Errors
    /// Settings that cannot be hashed.
    pub fn missing_videos(path: &Path, pipeline: &Pipeline) -> Result<Vec<PlannedUnit>> {
        match Self::read(path) {
            Ok(plan) if plan.settings == settings_hash(pipeline.config())? => plan.missing(pipeline),
            _ => Ok(Vec::new()),
        }
    }

    /// BLAKE3 of the plan without its seal.
    fn sealed(&self) -> Result<String> {
        let open = Self { seal: String::new(), ..self.clone() };
        Ok(blake3::hash(&serde_json::to_vec(&open)?).to_hex().to_string())
    }
}

fn has(videos: &Videos, unit: &PlannedUnit) -> bool {
    videos.speaker == unit.speaker && videos.units.iter().any(|known| known.video == unit.video)
}

/// BLAKE3 of the settings of videos and datasets: training comes after the plan, and how many work side by side has no
/// say in what they make.
pub fn settings_hash(config: &Config) -> Result<String> {
    let mut settings = config.settings.clone();
    settings.work.jobs = 0;
    settings.gan = GanConfig::default();
    settings.seq2seq = Seq2seqConfig::default();
    Ok(blake3::hash(&serde_json::to_vec(&settings)?).to_hex().to_string())
}

#[cfg(test)]
impl PlannedUnit {
    /// A video of unknown length for tests.
    pub fn example(speaker: &str, video: &str) -> Self {
        Self {
            speaker: speaker.to_owned(),
            video: video.to_owned(),
            source: video.into(),
            inputs: Vec::new(),
            secs: None,
            share: UnitShare::Whole,
            needs: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_dataset::config::load;

    fn video(name: &str, secs: f64) -> PlannedUnit {
        PlannedUnit { secs: Some(secs), ..PlannedUnit::example("host", name) }
    }

    #[test]
    fn long_videos_are_shared_and_what_others_wait_for_comes_first() {
        let units = in_order(vec![video("short", 300.0), video("long", 1700.0), video("middle", 899.0)], PIECE_SECS);
        let names: Vec<String> = units.iter().map(PlannedUnit::to_string).collect();
        let parts = ["host/long (part 1 of 3)", "host/long (part 2 of 3)", "host/long (part 3 of 3)"];
        assert_eq!(names[..2], ["host/long (extract)", "host/middle"]);
        assert_eq!(
            (&names[2..5], &names[5..]),
            (&parts.map(str::to_owned)[..], &["host/short", "host/long"].map(str::to_owned)[..])
        );
        assert_eq!(
            (&units[0].needs[..], &units[3].needs[..], &units[6].needs[..]),
            (&[][..], &[0][..], &[2, 3, 4][..])
        );
        let media: f64 = units.iter().filter_map(PlannedUnit::media_secs).sum();
        assert!((media - 2899.0).abs() < 1e-9);
    }

    #[test]
    fn a_plan_of_another_version_is_refused_with_what_to_do() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("plan.json");
        std::fs::write(&file, "{\"version\": 2, \"units\": [{\"bytes\": 1}]}").unwrap();
        let error = ClusterPlan::read(&file).unwrap_err().to_string();
        assert!(error.contains("version 2, expected 3: write it anew with `orator plan`"), "{error}");
    }

    #[test]
    fn settings_of_training_are_no_part_of_it() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("pipeline.toml");
        std::fs::write(&file, "[[speaker]]\nname = \"host\"\nvideos = [\"host/*.mp4\"]\n").unwrap();
        let hash = |set: &str| settings_hash(&load(&file, &[set.to_owned()]).unwrap()).unwrap();
        let plain = hash("work.jobs=2");
        for set in ["work.jobs=3", "gan.steps=7", "seq2seq.steps=7"] {
            assert_eq!(hash(set), plain, "{set}");
        }
        assert_ne!(hash("lift.smooth_arms=0.5"), plain);
    }
}
