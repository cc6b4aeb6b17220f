//! Stage `transcribe`: reads the audio that `extract` wrote, recognises its words where there is speech, and writes them
//! as a transcript, `words.json`, with times on the clock of the video file, like every other transcript.

use crate::sound;
use crate::speech::speech_rule::SpeechDetector;
use anyhow::{Context, Result};
use orator_base::stage::artifacts::{Artifact, StageName};
use orator_base::stage::progress::{Progress, Task};
use orator_base::stage::{Input, Report, Stage, Unit};
use orator_base::text::{counted, length};
use orator_base::types::sound::SAMPLE_RATE;
use orator_dataset::config::{Settings, TranscribeConfig};
use orator_dataset::info::ModelUsed;
use orator_formats::media_json::MediaInfo;
use orator_formats::transcript::{SpokenSegment, TranscriptFormat, Word, WordSource};
use orator_formats::wav::WavRanges;
use orator_onnx::{ModelEntry, ModelRequest, ModelStore, sha256_of};
use orator_speech::{Recognised, RecognisedSegment, RecognisedWord, Recogniser, RecogniserOptions};
use serde_json::{Value, json};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Beams of the search for words.
const BEAM: usize = 5;
/// Files with the weights of a folder that the manifest does not list.
const WEIGHTS: [&str; 2] = ["model.bin", "model.safetensors"];

/// Stage `transcribe`.
pub struct TranscribeStage {
    settings: TranscribeConfig,
    /// Folder of the recogniser.
    model: PathBuf,
    work: PathBuf,
    /// Speech detector; `None`: speech is detected by loudness only.
    speech: Option<SpeechDetector>,
}

/// Recognised words of an audio file, and the seconds of speech in it.
struct TranscribedAudio {
    found: Option<Recognised>,
    speech_secs: f64,
}

impl TranscribeStage {
    /// Creates the stage for the recogniser of the settings.
    ///
    /// # Errors
    /// The recogniser is missing or damaged (`ModelError`).
    pub fn new(settings: &Settings, speech: Option<SpeechDetector>) -> Result<Self> {
        let model = ModelStore::open(&settings.models.dir)?.recogniser(settings.transcribe.model_id())?;
        Ok(Self { settings: settings.transcribe.clone(), model, work: settings.work.dir.clone(), speech })
    }

    /// Model to pass to `ModelStore::fetch`, if the words of a speaker are recognised by a published one.
    pub fn required_models(settings: &Settings) -> Option<ModelRequest> {
        let is_needed = settings.transcribes_any() && settings.transcribe.is_published();
        is_needed.then(|| ModelRequest::Id(settings.transcribe.model_id().to_owned()))
    }

    /// Description of the recogniser for `info.json`, with the hash of its weights.
    ///
    /// # Errors
    /// Those of `new`; weights that cannot be read.
    pub fn used(settings: &Settings) -> Result<ModelUsed> {
        let (store, model) = (ModelStore::open(&settings.models.dir)?, Self::new(settings, None)?.model);
        let role = ModelUsed::WORDS.to_owned();
        if let Ok(entry) = store.manifest().get(settings.transcribe.model_id()) {
            let ModelEntry { id, sha256, origin, .. } = entry.clone();
            return Ok(ModelUsed { role, id, sha256, licence: origin.licence });
        }
        let weights = WEIGHTS.map(|file| model.join(file)).into_iter().find(|path| path.is_file());
        let weights = weights
            .with_context(|| format!("{} contains no weights: expected {}", model.display(), WEIGHTS.join(" or ")))?;
        let id = model.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(ModelUsed { role, id, sha256: sha256_of(&weights)?, licence: String::new() })
    }

    /// Recognises the words of a 16 kHz wav file, read in pieces.
    fn recognise(&self, path: &Path, progress: &dyn Progress) -> Result<TranscribedAudio> {
        let mut wav = WavRanges::open(path, SAMPLE_RATE)?;
        let n_samples = wav.n_samples();
        let speech = match &self.speech {
            Some(detector) => detector.ranges(path)?,
            None => sound::loud_ranges(path)?,
        };
        let speech_secs = speech.iter().map(|range| range.end - range.start).sum::<f64>() + 0.0;
        if speech_secs <= 0.0 {
            return Ok(TranscribedAudio { found: None, speech_secs });
        }
        let task = progress.begin("", n_samples.div_ceil(SAMPLE_RATE as usize) as u64);
        let mut advance = steps_of(task);
        let mut source = |samples: Range<usize>| wav.read(samples);
        let language = Some(self.settings.language.clone()).filter(|code| !code.is_empty());
        let options = RecogniserOptions { language, beam: BEAM };
        let recogniser = Recogniser::open(&self.model)?;
        let found = recogniser.recognise(&mut source, n_samples, &speech, &options, &mut advance)?;
        Ok(TranscribedAudio { found: Some(found), speech_secs })
    }
}

impl Stage for TranscribeStage {
    fn name(&self) -> &'static str {
        StageName::Transcribe.as_str()
    }

    fn version(&self) -> u32 {
        1
    }

    fn cost(&self) -> u32 {
        10
    }

    fn settings(&self, _unit: &Unit) -> Value {
        let speech_model = self.speech.as_ref().map(SpeechDetector::used);
        json!({ "language": self.settings.language, "beam": BEAM, "speech_model": speech_model })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let input = |role: &str, path| Input { role: role.to_owned(), path };
        let sound = Artifact::Sound.path(&self.work, unit);
        let mut inputs =
            vec![input("media", Artifact::MediaInfo.path(&self.work, unit)), input("recogniser", self.model.clone())];
        inputs.extend(sound.exists().then(|| input("sound", sound)));
        Ok(inputs)
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let media = MediaInfo::read(&Artifact::MediaInfo.path(&self.work, unit))?;
        let sound = Artifact::Sound.path(&self.work, unit);
        let words = match sound.exists() {
            true => self.recognise(&sound, progress)?,
            false => TranscribedAudio { found: None, speech_secs: 0.0 },
        };
        let (language, found) = words.found.map_or_else(Default::default, |found| (found.language, found.segments));
        let segments = spoken(found, media.first_image_secs);
        let text = TranscriptFormat::Json.write(&segments, &language, media.duration_secs);
        let path = Artifact::Words.within(out);
        std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        let n_words: usize = segments.iter().map(|segment| segment.words.len()).sum();
        let mut line = format!("{} in {} of speech", counted(n_words, "word"), length(words.speech_secs));
        if !language.is_empty() {
            line += &format!(", language {language}");
        }
        let model = self.settings.model_id();
        let facts = json!({
            "n_words": n_words, "speech_secs": words.speech_secs, "language": language, "recogniser": model,
        });
        Ok(Report { line: format!("{line} ({model})"), facts: facts.as_object().cloned().unwrap_or_default() })
    }
}

/// Reports the seconds done so far as steps of a task, one a second.
pub fn steps_of<'a>(task: Box<dyn Task + 'a>) -> impl FnMut(f64) + 'a {
    let mut n_reported = 0;
    move |secs: f64| {
        let n_steps = (secs.max(0.0) as u64).saturating_sub(n_reported);
        task.advance(n_steps);
        n_reported += n_steps;
    }
}

/// Segments of a transcript; `start_secs` is the start of the audio in the file, seconds.
pub fn spoken(found: Vec<RecognisedSegment>, start_secs: f64) -> Vec<SpokenSegment> {
    let word = |word: RecognisedWord| Word {
        word: word.word,
        start_secs: start_secs + word.start_secs,
        end_secs: start_secs + word.end_secs,
        source: WordSource::Given,
        confidence: Some(f64::from(word.probability)),
    };
    let segment = |segment: RecognisedSegment| SpokenSegment {
        start_secs: start_secs + segment.start_secs,
        end_secs: start_secs + segment.end_secs,
        text: segment.text,
        words: segment.words.into_iter().map(word).collect(),
    };
    found.into_iter().map(segment).collect()
}
