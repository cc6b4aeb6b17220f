//! Conditions of a study: the sources of the motion in its films.

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "WrittenCondition", into = "WrittenCondition")]
pub struct StudyCondition {
    pub name: String,
    pub source: ConditionSource,
    /// Whether this is the real condition of Turing tests.
    pub real: bool,
    /// Table of vectors for words that are not in the vocabulary of the model; only for checkpoints.
    pub words: Option<PathBuf>,
    /// Whether the model is requested to carry its decoder state across segments; only for checkpoints.
    pub carry_state: bool,
}

/// Source of a condition's motion. In paths, `{speaker}` and `{clip}` stand for names.
#[derive(Clone, Debug, PartialEq)]
pub enum ConditionSource {
    /// Motion of the dataset.
    Natural,
    /// Motion generated from the speech by a model; path of its checkpoint, a folder or file.
    Checkpoint(PathBuf),
    /// Motion of the named condition for the speech of another clip. If the file names none, the only model is used.
    Mismatched(String),
    /// Static mean pose of the dataset.
    MeanPose,
    /// Motion files, one per clip.
    Files(PathBuf),
}

impl ConditionSource {
    /// Name of the condition whose motion a mismatched condition uses.
    pub fn mismatch_of(&self) -> Option<&str> {
        match self {
            Self::Mismatched(of) => Some(of),
            Self::Natural | Self::Checkpoint(_) | Self::MeanPose | Self::Files(_) => None,
        }
    }

    pub fn path_mut(&mut self) -> Option<&mut PathBuf> {
        match self {
            Self::Checkpoint(path) | Self::Files(path) => Some(path),
            Self::Natural | Self::Mismatched(_) | Self::MeanPose => None,
        }
    }
}

/// Replaces `{speaker}` and `{clip}` in `pattern`; of a clip name `speaker/clip` only the last part is used.
pub fn fill_pattern(pattern: &Path, speaker: &str, clip: &str) -> PathBuf {
    let clip = clip.rsplit('/').next().unwrap_or(clip);
    pattern.to_string_lossy().replace("{speaker}", speaker).replace("{clip}", clip).into()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ConditionKind {
    Natural,
    Checkpoint,
    Mismatched,
    MeanPose,
    Files,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenCondition {
    name: String,
    kind: ConditionKind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    checkpoint: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    of: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    files: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    real: Option<bool>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    words: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    carry_state: bool,
}

impl TryFrom<WrittenCondition> for StudyCondition {
    type Error = String;

    fn try_from(written: WrittenCondition) -> Result<Self, String> {
        let WrittenCondition { name, kind, checkpoint, of, files, real, words, carry_state } = written;
        if kind != ConditionKind::Checkpoint && (words.is_some() || carry_state) {
            let rule = "the keys words and carry_state apply to the kind checkpoint";
            return Err(format!("condition {name}: {rule}; remove them"));
        }
        let missing =
            |key: &str, example: &str| format!("condition {name}: missing key {key}: expected for example {example}");
        let source = match (kind, checkpoint, of, files) {
            (ConditionKind::Natural, None, None, None) => ConditionSource::Natural,
            (ConditionKind::MeanPose, None, None, None) => ConditionSource::MeanPose,
            (ConditionKind::Checkpoint, Some(path), None, None) => ConditionSource::Checkpoint(path),
            (ConditionKind::Mismatched, None, of, None) => ConditionSource::Mismatched(of.unwrap_or_default()),
            (ConditionKind::Files, None, None, Some(path)) => ConditionSource::Files(path),
            (ConditionKind::Checkpoint, None, None, None) => {
                return Err(missing("checkpoint", "checkpoint = \"models/{speaker}\""));
            }
            (ConditionKind::Files, None, None, None) => return Err(missing("files", "files = \"other/{clip}.bvh\"")),
            _ => {
                let rule = "the key checkpoint applies to the kind checkpoint, of to mismatched, files to files";
                return Err(format!("condition {name}: {rule}; remove the other keys"));
            }
        };
        let real = real.unwrap_or(source == ConditionSource::Natural);
        Ok(Self { name, source, real, words, carry_state })
    }
}

impl From<StudyCondition> for WrittenCondition {
    fn from(condition: StudyCondition) -> Self {
        let StudyCondition { name, source, real, words, carry_state } = condition;
        let (kind, real) = (ConditionKind::Natural, Some(real));
        let written = Self { name, kind, checkpoint: None, of: None, files: None, real, words, carry_state };
        match source {
            ConditionSource::Natural => written,
            ConditionSource::MeanPose => Self { kind: ConditionKind::MeanPose, ..written },
            ConditionSource::Checkpoint(path) => {
                Self { kind: ConditionKind::Checkpoint, checkpoint: Some(path), ..written }
            }
            ConditionSource::Mismatched(of) => Self { kind: ConditionKind::Mismatched, of: Some(of), ..written },
            ConditionSource::Files(path) => Self { kind: ConditionKind::Files, files: Some(path), ..written },
        }
    }
}
