//! Dataset from recorded speech with word times, with motion by the second rule, `speech_gestures`.

use super::speech_events::SpeechEvents;
use super::speech_gestures::SpeechGestures;
use crate::spoken_video::SpokenVideo;
use anyhow::{Context, Result, ensure};
use orator_base::stage::progress::Progress;
use orator_base::types::sound::{SAMPLE_RATE, sample_at};
use orator_base::types::split::Split;
use orator_base::types::time::FrameRate;
use orator_dataset::info::{About, DatasetInfo};
use orator_dataset::sample::Sample;
use orator_dataset::write::assemble::DatasetWriter;
use orator_formats::transcript::Transcript;
use orator_media::ffmpeg::audio;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Version of the rule, stored under `rule` in the JSON of a sample.
pub const RULE_OF_SPEECH: u32 = 3;
/// Key, under `rule`, of the start and the target of the spoken words with gestures, if the words were recognised.
const SPOKEN: &str = "spoken";
const NAME: &str = "spoken";
const FPS: FrameRate = FrameRate::new(15, 1);
const SHARD_BYTES: u64 = 256 << 20;

/// Whether a sample follows the second rule.
pub fn is_by_speech(sample: &Sample) -> bool {
    sample.meta.pointer("/rule/rule").and_then(serde_json::Value::as_u64) == Some(u64::from(RULE_OF_SPEECH))
}

/// Events of a sample's speech, from its audio and words; the spoken words if those of the sample were recognised.
pub fn events(sample: &Sample) -> SpeechEvents {
    let mut events = SpeechEvents::detect(&sample.sound, sample.words.as_deref().unwrap_or_default());
    let spoken = sample.meta.pointer(&format!("/rule/{SPOKEN}")).cloned();
    if let Some(Ok(spoken)) = spoken.map(serde_json::from_value) {
        events.words = spoken;
    }
    events
}

/// Predictable part of a sample's motion: the rule without variation, for its audio and words.
pub fn predictable(sample: &Sample) -> orator_base::types::pose3d::Motion {
    SpeechGestures::new(&events(sample)).motion(sample.n_frames(), sample.motion.fps)
}

/// Speech in a folder: `NAME.wav` with `NAME.tsv`, and `NAME.json` if its words were recognised. The split is the one
/// that the name begins with, else train.
///
/// # Errors
/// A folder without speech, or audio without words, with the name of the file.
pub fn speech_of(folder: &Path) -> Result<Vec<(PathBuf, Split)>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("cannot read the folder {}", folder.display()))?;
    let mut sounds: Vec<PathBuf> = entries.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    sounds.retain(|path| path.extension().is_some_and(|ending| ending == "wav"));
    sounds.sort();
    ensure!(!sounds.is_empty(), "no .wav file in {}: expected a folder of NAME.wav with NAME.tsv", folder.display());
    for sound in &sounds {
        let words = sound.with_extension("tsv");
        ensure!(
            words.is_file(),
            "no word times for {}: expected {} with one row of start, end and word per word",
            sound.display(),
            words.display()
        );
    }
    let split = |path: &Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Split::ALL.into_iter().find(|split| name.starts_with(split.name())).unwrap_or(Split::Train)
    };
    Ok(sounds.into_iter().map(|sound| (sound.clone(), split(&sound))).collect())
}

/// Writes the speech as a dataset into the existing, empty folder `dir`; `seed` determines the variation.
pub fn write(dir: &Path, speech: &[(PathBuf, Split)], seed: u64, progress: &dyn Progress) -> Result<DatasetInfo> {
    let about = About {
        licence: "cc0-1.0".to_owned(),
        consent: "none needed: nobody is shown".to_owned(),
        source: "made by orator demo speaker".to_owned(),
        notes: vec![format!("Gestures follow version {RULE_OF_SPEECH} of a known rule; pose2d is 0 everywhere.")],
        ..About::new(NAME, FPS)
    };
    let writer = DatasetWriter::new(dir, about, SHARD_BYTES);
    let task = progress.begin("generate gestures", speech.len() as u64);
    for (file, split) in speech {
        spoken(file, seed)?.write(&writer, *split)?;
        task.advance(1);
    }
    Ok(writer.finish()?.0)
}

fn spoken(file: &Path, seed: u64) -> Result<SpokenVideo> {
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut sound = audio::read_mono(file, SAMPLE_RATE)?.with_context(|| format!("no audio in {}", file.display()))?;
    let n_frames = FPS.frames_in(sound.secs());
    ensure!(n_frames > 0, "{} is too short: expected at least one frame", file.display());
    sound.samples.truncate(sample_at(FPS, SAMPLE_RATE, n_frames));
    let transcript = Transcript::read(&file.with_extension("tsv"))?;
    let mut words: Vec<_> = transcript.words.into_iter().filter(|word| word.end_secs <= sound.secs()).collect();
    let hash = blake3::hash(format!("{RULE_OF_SPEECH} {seed} {name}").as_bytes());
    let events = SpeechEvents::detect(&sound, &words);
    let gestures = SpeechGestures::varied(&events, &mut ChaCha8Rng::from_seed(*hash.as_bytes()));
    let (recognised, mut rule) = (file.with_extension("json"), json!({ "rule": RULE_OF_SPEECH, "seed": seed }));
    if recognised.is_file() {
        words = Transcript::read(&recognised)?.words;
        rule[SPOKEN] = json!(events.words);
    }
    Ok(SpokenVideo {
        content: hash.to_hex().to_string(),
        motion: gestures.motion(n_frames, FPS),
        posture: Some(gestures.posture(n_frames, FPS)),
        sound,
        words: Some(words),
        meta: json!({ "rule": rule }),
        name,
    })
}
