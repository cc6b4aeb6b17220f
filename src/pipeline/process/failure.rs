//! Errors sent from a subprocess to the run: message texts without terminal control characters, and the error type, so
//! that callers can still match it.

use anyhow::{Error, anyhow};
use orator_base::stage::workdir::NoSpace;
use orator_media::ffmpeg::UnreadableMedia;
use orator_onnx::ModelError;
use serde::{Deserialize, Serialize};

/// Serialised form of an error.
#[derive(Debug, Serialize, Deserialize)]
pub struct SentFailure {
    /// Messages of the error and its causes, outermost first.
    texts: Vec<String>,
    kind: FailureKind,
}

/// Type of the error; for a type that is part of the cause chain, also the index of its text.
#[derive(Debug, Serialize, Deserialize)]
enum FailureKind {
    Other,
    NoSpace,
    Media(usize),
    Model(usize, ModelError),
}

impl SentFailure {
    /// Serialises an error.
    pub fn of(error: &Error) -> Self {
        let texts: Vec<String> = error.chain().map(ToString::to_string).collect();
        let at = |text: String| texts.iter().position(|other| *other == text).unwrap_or(0);
        let kind = if error.is::<NoSpace>() {
            FailureKind::NoSpace
        } else if let Some(media) = error.downcast_ref::<UnreadableMedia>() {
            FailureKind::Media(at(media.to_string()))
        } else if let Some(model) = error.downcast_ref::<ModelError>() {
            FailureKind::Model(at(model.to_string()), model.clone())
        } else {
            FailureKind::Other
        };
        Self { texts, kind }
    }

    /// Restores the error with its texts and a type that `downcast_ref` finds.
    pub fn into_error(self) -> Error {
        let kind = match self.kind {
            FailureKind::Model(_, model) if plain(&model.to_string()) != model.to_string() => FailureKind::Other,
            kind => kind,
        };
        let mut error: Option<Error> = None;
        for (at, text) in self.texts.iter().map(|text| plain(text)).enumerate().rev() {
            error = Some(match (&kind, error) {
                (FailureKind::Media(index), None) if *index == at => UnreadableMedia(text).into(),
                (FailureKind::Media(index), Some(cause)) if *index == at => cause.context(UnreadableMedia(text)),
                (FailureKind::Model(index, model), None) if *index == at => model.clone().into(),
                (FailureKind::Model(index, model), Some(cause)) if *index == at => cause.context(model.clone()),
                (_, None) => anyhow!(text),
                (_, Some(cause)) => cause.context(text),
            });
        }
        let error = error.unwrap_or_else(|| anyhow!("the process failed without an error message"));
        if matches!(kind, FailureKind::NoSpace) { NoSpace::new(error).into() } else { error }
    }
}

/// Replaces terminal control characters (all but newline and tab) by U+FFFD.
pub fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() && c != '\n' && c != '\t' { '\u{fffd}' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context as _;
    use orator_base::stage::workdir;

    /// Sends an error through the serialised form and checks its texts.
    fn sent(error: &Error) -> Error {
        let bytes = rmp_serde::to_vec(&SentFailure::of(error)).unwrap();
        let failure: SentFailure = rmp_serde::from_slice(&bytes).unwrap();
        let back = failure.into_error();
        assert_eq!(format!("{back:#}"), format!("{error:#}"));
        assert_eq!(back.to_string(), error.to_string());
        back
    }

    #[test]
    fn errors_round_trip_with_their_texts_and_types() {
        let media = || UnreadableMedia("a.mp4 is empty".to_owned());
        assert!(sent(&media().into()).is::<UnreadableMedia>());
        assert!(sent(&Error::from(media()).context("the stage")).downcast_ref() == Some(&media()));
        let missing = std::fs::File::open("/nowhere/at/all").with_context(media).context("more");
        assert!(sent(&missing.unwrap_err()).downcast_ref() == Some(&media()));

        let model = ModelError::Missing { id: "body".into(), path: "models/body.onnx".into() };
        let back = sent(&Error::from(model).context("frame 3"));
        assert!(matches!(back.downcast_ref(), Some(ModelError::Missing { id, .. }) if id == "body"));

        let full = Error::from(std::io::Error::from(std::io::ErrorKind::StorageFull)).context("cannot write a");
        assert!(sent(&workdir::full_disk(full)).is::<NoSpace>());
        let other = sent(&anyhow!("a").context("b").context("c"));
        assert!(!other.is::<NoSpace>() && other.downcast_ref::<UnreadableMedia>().is_none());
    }

    #[test]
    fn terminal_control_characters_are_replaced() {
        assert_eq!(plain("a\u{1b}[2Jb\nc"), "a\u{fffd}[2Jb\nc");
    }
}
