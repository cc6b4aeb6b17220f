//! Audio and motion of the synthetic speaker as one video entry of a dataset, without an actual video.

use anyhow::Result;
use ndarray::Array3;
use orator_base::motion::bones;
use orator_base::stage::ledger::{AcceptedInterval, Ledger, TranscriptReport, WordCount};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::sound::Sound;
use orator_base::types::split::Split;
use orator_dataset::bones::VideoBones;
use orator_dataset::sample::{N_KEYPOINTS, Sample};
use orator_dataset::split::SplitBy;
use orator_dataset::write::assemble::DatasetWriter;
use orator_dataset::write::entry::VideoSource;
use orator_formats::transcript::Word;
use serde_json::{Value, json};

/// Speech and motion of one entry.
pub struct SpokenVideo {
    /// Name in the dataset.
    pub name: String,
    /// BLAKE3 of the parameters that determine the content.
    pub content: String,
    pub motion: Motion,
    /// Audio at 16 kHz, of the duration of the motion.
    pub sound: Sound,
    pub words: Option<Vec<Word>>,
    /// Angles of head and trunk, of the length of the motion; `None` if unknown.
    pub posture: Option<Posture>,
    /// Additional metadata of the sample; a JSON object.
    pub meta: Value,
}

impl SpokenVideo {
    /// Adds the entry to a split of a dataset.
    pub fn write(self, writer: &DatasetWriter, split: Split) -> Result<()> {
        let (source, sample) = (self.source(), self.sample());
        let mut video = writer.video(source, split, SplitBy::Name)?;
        video.push(&sample, 0.0)?;
        video.finish(None)?;
        Ok(())
    }

    fn secs(&self) -> f64 {
        self.motion.fps.secs(self.motion.n_frames())
    }

    fn source(&self) -> VideoSource {
        let (secs, n_frames) = (self.secs(), self.motion.n_frames());
        let words = self.words.as_ref().map(|words| TranscriptReport {
            count: WordCount { n_words: words.len(), n_accepted: words.len(), ..WordCount::default() },
            ..TranscriptReport::default()
        });
        VideoSource {
            name: self.name.clone(),
            file: format!("{}.mp4", self.name),
            content: self.content.clone(),
            ledger: Ledger {
                duration_secs: secs,
                accepted: vec![AcceptedInterval { start_secs: 0.0, end_secs: secs }],
                words,
                ..Ledger::default()
            },
            bones: VideoBones { lengths_metres: bones::measure(&self.motion).map(f64::from).to_vec(), n_frames },
            ..VideoSource::default()
        }
    }

    fn sample(self) -> Sample {
        let (secs, n_frames) = (self.secs(), self.motion.n_frames());
        let mut meta = json!({
            "video": self.name, "first_frame": 0, "n_frames": n_frames, "fps": self.motion.fps, "start_secs": 0.0,
            "end_secs": secs, "image_size": null, "left_hand_seen": 1.0, "right_hand_seen": 1.0,
            "sound_samples_padded": 0,
        });
        if let (Some(meta), Value::Object(more)) = (meta.as_object_mut(), self.meta) {
            meta.extend(more);
        }
        Sample {
            key: format!("{}-{:06}", self.name, 0),
            pose2d: Array3::zeros((n_frames, N_KEYPOINTS, 3)),
            motion: self.motion,
            sound: self.sound,
            words: self.words,
            posture: self.posture,
            interlocutor: None,
            meta,
        }
    }
}
