//! Datasets of the synthetic speaker without video: audio and motion by `rule`, in the layout of the pipeline. Each
//! clip is determined by seed, split and number alone, so splits share neither speech nor variation, and the
//! predictable part of a clip can be recomputed.

use super::habits::Habits;
use super::rule::RuleGestures;
use super::words;
use crate::drawn::speech::Speech;
use crate::spoken_video::SpokenVideo;
use anyhow::{Context, Result, ensure};
use orator_base::stage::progress::Progress;
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::{SAMPLE_RATE, Sound, sample_at};
use orator_base::types::split::Split;
use orator_base::types::time::FrameRate;
use orator_dataset::info::{About, DatasetInfo};
use orator_dataset::sample::Sample;
use orator_dataset::write::assemble::DatasetWriter;
use orator_formats::transcript::Word;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::path::Path;

/// Versions of the rule and of its speech: depending on audio only, and with words. Other versions are rejected where
/// the predictable part is needed.
pub const RULE: u32 = 1;
pub const RULE_OF_WORDS: u32 = 2;
pub const NAME: &str = "synthetic";
const FPS: FrameRate = FrameRate::new(15, 1);
/// Length of a clip in frames (one minute).
const CLIP_FRAMES: usize = 900;
/// Number of clips (minutes) of the validation and test split, and of the test split if the rule has words.
const HELD_OUT_CLIPS: usize = 10;
const TEST_CLIPS_OF_WORDS: usize = 30;
/// Amplitude of the background noise.
const NOISE: f32 = 0.001;
const SHARD_BYTES: u64 = 256 << 20;

/// Parameters of a clip, stored in its sample's JSON under `rule`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SpokenClip {
    pub rule: u32,
    pub seed: u64,
    pub split: Split,
    pub number: usize,
    pub n_frames: usize,
    /// Number of the speaker's habits, see `Habits::numbered`.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub habits: u64,
}

fn is_zero(number: &u64) -> bool {
    *number == 0
}

impl SpokenClip {
    fn secs(&self) -> f64 {
        FPS.secs(self.n_frames)
    }

    fn name(&self) -> String {
        format!("{NAME}-{}-{:04}", self.split.name(), self.number)
    }

    /// Random generator for one purpose.
    fn rng(&self, purpose: &str) -> ChaCha8Rng {
        let Self { rule, seed, split, number, .. } = self;
        let hash = blake3::hash(format!("{rule} {seed} {} {number} {purpose}", split.name()).as_bytes());
        ChaCha8Rng::from_seed(*hash.as_bytes())
    }

    /// Habits of its speaker.
    pub fn habits(&self) -> Habits {
        Habits::numbered(self.habits)
    }

    /// Speech of the clip.
    pub fn speech(&self) -> Speech {
        Speech::free(self.secs(), &mut self.rng("speech"))
    }

    /// Words of the clip; empty if the rule has none.
    pub fn words(&self) -> Vec<Word> {
        match self.rule {
            RULE_OF_WORDS => words::words(&self.speech(), self.split, &mut self.rng("words")),
            _ => Vec::new(),
        }
    }

    /// Audio of the clip with background noise.
    pub fn sound(&self) -> Sound {
        let mut rng = self.rng("sound");
        let mut sound = self.speech().sound(self.secs(), &mut rng);
        sound.samples.resize(sample_at(FPS, SAMPLE_RATE, self.n_frames), 0.0);
        sound.samples.iter_mut().for_each(|sample| *sample += NOISE * rng.random_range(-1.0..1.0));
        sound
    }

    /// Motion of the clip: rule and variation.
    pub fn motion(&self) -> Motion {
        let rng = &mut self.rng("whims");
        let (speech, words) = (self.speech(), self.words());
        RuleGestures::varied(&self.habits(), &speech, &words, self.secs(), rng).motion(self.n_frames, FPS)
    }

    /// Predictable part of the motion: the rule alone.
    pub fn predictable(&self) -> Motion {
        RuleGestures::of_habits(&self.habits(), &self.speech(), &self.words()).motion(self.n_frames, FPS)
    }

    /// BLAKE3 of the clip's parameters; the hashed text must stay the same for existing datasets.
    fn content_hash(&self) -> String {
        let Self { rule, seed, split, number, n_frames, habits } = self;
        let habits = if *habits == 0 { String::new() } else { format!(", habits: {habits}") };
        let text = format!(
            "Clip {{ rule: {rule}, seed: {seed}, split: {split:?}, number: {number}, n_frames: {n_frames}{habits} }}"
        );
        blake3::hash(text.as_bytes()).to_hex().to_string()
    }

    /// Clip that a sample of the dataset was generated from.
    ///
    /// # Errors
    /// A sample of another speaker or of an unknown version of the rule.
    pub fn from_sample(sample: &Sample) -> Result<Self> {
        let clip: Self =
            serde_json::from_value(sample.meta.get("rule").cloned().unwrap_or_default()).with_context(|| {
                format!("the sample {} has no rule: expected a dataset of `orator-lab demo speaker`", sample.key)
            })?;
        ensure!(
            [RULE, RULE_OF_WORDS].contains(&clip.rule),
            "unknown version {} of the rule in the sample {}: expected {RULE} or {RULE_OF_WORDS}",
            clip.rule,
            sample.key
        );
        ensure!(
            clip.n_frames == sample.n_frames(),
            "the sample {} has {} frames: expected {}",
            sample.key,
            sample.n_frames(),
            clip.n_frames
        );
        Ok(clip)
    }

    fn spoken(&self) -> SpokenVideo {
        SpokenVideo {
            name: self.name(),
            content: self.content_hash(),
            motion: self.motion(),
            sound: self.sound(),
            posture: None,
            words: (self.rule == RULE_OF_WORDS).then(|| self.words()),
            meta: json!({ "rule": self }),
        }
    }
}

/// Clips for `hours` of training, ten minutes of validation, and ten of test, or thirty if the rule has words.
pub fn clips(hours: f64, seed: u64, rule: u32, habits: u64) -> Result<Vec<SpokenClip>> {
    ensure!((0.01..=100.0).contains(&hours), "invalid --hours {hours}: expected 0.01 to 100");
    let n_train = (hours * 3600.0 / FPS.secs(CLIP_FRAMES)).ceil() as usize;
    let clips_of =
        |split, n| (0..n).map(move |number| SpokenClip { rule, seed, split, number, n_frames: CLIP_FRAMES, habits });
    let n_test = if rule == RULE_OF_WORDS { TEST_CLIPS_OF_WORDS } else { HELD_OUT_CLIPS };
    let parts = [(Split::Train, n_train), (Split::Validation, HELD_OUT_CLIPS), (Split::Test, n_test)];
    Ok(parts.into_iter().flat_map(|(split, n)| clips_of(split, n)).collect())
}

/// Writes `clips` as a dataset into the existing, empty folder `dir`.
pub fn write(dir: &Path, clips: &[SpokenClip], progress: &dyn Progress) -> Result<DatasetInfo> {
    let rule = clips.first().map_or(RULE, |clip| clip.rule);
    let name = match clips.first().map_or(0, |clip| clip.habits) {
        0 => NAME.to_owned(),
        habits => format!("{NAME}-{habits}"),
    };
    let about = About {
        licence: "cc0-1.0".to_owned(),
        consent: "none needed: nobody is shown".to_owned(),
        source: "made by orator demo speaker".to_owned(),
        notes: vec![format!("Gestures follow version {rule} of a known rule; pose2d is 0 everywhere.")],
        ..About::new(&name, FPS)
    };
    let writer = DatasetWriter::new(dir, about, SHARD_BYTES);
    let task = progress.begin("generate speech", clips.len() as u64);
    for batch in clips.chunks(16) {
        let spoken: Vec<SpokenVideo> = batch.par_iter().map(SpokenClip::spoken).collect();
        for (clip, spoken) in batch.iter().zip(spoken) {
            spoken.write(&writer, clip.split)?;
            task.advance(1);
        }
    }
    Ok(writer.finish()?.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::stage::progress::Silent;
    use orator_dataset::Dataset;
    use orator_dataset::verify::verify::verify;

    #[test]
    fn a_dataset_is_valid_and_its_predictable_part_is_reproducible() {
        verify_rule(RULE);
        verify_rule(RULE_OF_WORDS);
    }

    fn verify_rule(rule: u32) {
        let dir = tempfile::tempdir().unwrap();
        let two =
            |split| (0..2).map(move |number| SpokenClip { rule, seed: 7, split, number, n_frames: 90, habits: 3 });
        let clips: Vec<SpokenClip> = Split::ALL.into_iter().flat_map(two).collect();
        let info = write(dir.path(), &clips, &Silent).unwrap();
        assert_eq!(info.splits.values().map(|split| split.samples).collect::<Vec<_>>(), [2, 2, 2]);
        let verified = verify(dir.path(), true, &Silent).unwrap();
        assert!(verified.problems.is_empty(), "{:?}", verified.problems);
        let dataset = Dataset::open(dir.path()).unwrap();
        for sample in dataset.samples(Split::Test) {
            let sample = dataset.read(&sample).unwrap();
            let clip = SpokenClip::from_sample(&sample).unwrap();
            assert_eq!(clip.motion(), sample.motion);
            assert_ne!(clip.predictable(), sample.motion);
            assert_eq!(sample.words.is_some_and(|words| !words.is_empty()), rule == RULE_OF_WORDS);
        }
        let again = tempfile::tempdir().unwrap();
        write(again.path(), &clips, &Silent).unwrap();
        let sums = |dir: &Path| std::fs::read(dir.join(orator_dataset::CHECKSUMS)).unwrap();
        assert_eq!(sums(dir.path()), sums(again.path()));
    }

    #[test]
    fn no_two_clips_share_speech() {
        let clips = clips(0.1, 3, RULE, 0).unwrap();
        assert_eq!(clips.len(), 6 + 2 * HELD_OUT_CLIPS);
        let speeches: Vec<_> = clips.iter().map(|clip| format!("{:?}", clip.speech().syllables)).collect();
        let different: std::collections::BTreeSet<&String> = speeches.iter().collect();
        assert_eq!(different.len(), speeches.len());
        assert!(super::clips(f64::NAN, 1, RULE, 0).is_err() && super::clips(0.0, 1, RULE, 0).is_err());
    }
}
