//! Which mouth of a shot the voice is of: the one whose opening agrees best with it, where that is no chance.

use crate::lip_sync::LipVoiceMatch;
use orator_base::audio::openness::Openness;
use orator_base::types::time::FrameRate;

/// Confidence from which an agreement is none of chance; lower than for an offset, as one of few people it is.
const CLEAR: f64 = 0.9;
/// The best agreement is this much above the next, in correlations of a second (`SoundOffset` has its distribution).
const MARGIN: f64 = 0.15;

/// The sound beside the frames of a shot.
pub struct ShotVoice<'a> {
    pub voice: &'a Openness,
    pub fps: FrameRate,
    /// Per frame of the shot: the time of the picture in seconds, and whether there is speech.
    pub time_secs: &'a [f64],
    pub is_speech: &'a [bool],
}

/// How open a mouth was from frame `first` of the shot on; NaN: not seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MouthOpening {
    pub first: usize,
    pub opening: Vec<f32>,
}

impl MouthOpening {
    /// Sets the opening at a frame later than those before.
    pub fn set(&mut self, idx: usize, opening: f32) {
        if self.opening.is_empty() {
            self.first = idx;
        }
        self.opening.resize(idx.saturating_sub(self.first), f32::NAN);
        self.opening.push(opening);
    }

    /// A frame that shows what the one before does.
    pub fn repeat(&mut self, idx: usize) {
        if let Some(&opening) = self.opening.last().filter(|_| self.first + self.opening.len() == idx) {
            self.set(idx, opening);
        }
    }

    /// The agreement with the voice and the confidence that it is no chance; `None`: too little was seen.
    fn agreement(&self, heard: &ShotVoice) -> Option<(f64, f64)> {
        let end = (self.first + self.opening.len()).min(heard.time_secs.len()).min(heard.is_speech.len());
        let frames = self.first.min(end)..end;
        let opening = self.opening.get(..frames.len())?;
        let (time_secs, is_speech) = (&heard.time_secs[frames.clone()], &heard.is_speech[frames]);
        let offset = LipVoiceMatch::new(opening, time_secs, is_speech, heard.voice, heard.fps).offset()?;
        Some((offset.correlation * offset.compared_secs.sqrt(), offset.confidence))
    }
}

/// The mouth of the voice; `None`: no agreement is clear.
pub fn speaking<'a>(mouths: impl Iterator<Item = &'a MouthOpening>, heard: &ShotVoice) -> Option<usize> {
    let mut agreements: Vec<(usize, f64, f64)> = mouths
        .enumerate()
        .filter_map(|(at, mouth)| mouth.agreement(heard).map(|(agreement, confidence)| (at, agreement, confidence)))
        .collect();
    agreements.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (at, best, confidence) = *agreements.first()?;
    let next = agreements.get(1).map_or(f64::NEG_INFINITY, |(_, agreement, _)| *agreement);
    (confidence >= CLEAR && best - next >= MARGIN).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lip_sync::tests::{FPS, Mouth};

    const SECS: f64 = 12.0;

    fn opened(mouth: &Mouth, from: usize) -> MouthOpening {
        let mut opened = MouthOpening::default();
        let (opening, _) = mouth.seen(SECS, 9, 4);
        let seen = opening.iter().enumerate().skip(from).filter(|(_, opening)| opening.is_finite());
        seen.for_each(|(idx, opening)| opened.set(idx, *opening));
        opened
    }

    fn said_by(voice: &Openness, mouths: &[MouthOpening]) -> Option<usize> {
        let time_secs: Vec<f64> = (0..FPS.frames_in(SECS)).map(|t| FPS.secs(t)).collect();
        let is_speech = vec![true; time_secs.len()];
        speaking(mouths.iter(), &ShotVoice { voice, fps: FPS, time_secs: &time_secs, is_speech: &is_speech })
    }

    #[test]
    fn the_voice_is_of_the_mouth_that_follows_it_whichever_and_whenever_seen() {
        for seed in 0..5 {
            let (first, second) = (Mouth::new(SECS, seed), Mouth::new(SECS, seed + 100));
            let mouths = [opened(&first, 0), opened(&second, 40)];
            assert_eq!(said_by(&first.voice(SECS, 0.0), &mouths), Some(0), "{seed}");
            assert_eq!(said_by(&second.voice(SECS, 0.1), &mouths), Some(1), "{seed}");
        }
    }

    #[test]
    fn without_a_clear_mouth_nobody_is_told() {
        let (first, second, third) = (Mouth::new(SECS, 1), Mouth::new(SECS, 2), Mouth::new(SECS, 3));
        let voice = third.voice(SECS, 0.0);
        assert_eq!(said_by(&voice, &[opened(&first, 0), opened(&second, 0)]), None);
        assert_eq!(said_by(&voice, &[opened(&third, 0), opened(&third, 0)]), None, "two of one mouth");
        assert_eq!(said_by(&voice, &[opened(&third, 150), opened(&first, 0)]), None, "seen for 2 s");
        assert_eq!(said_by(&Openness::default(), &[opened(&third, 0)]), None);
        assert_eq!(said_by(&voice, &[]), None);
    }

    #[test]
    fn unseen_frames_are_not_known_and_repeated_ones_are_as_before() {
        let mut mouth = MouthOpening::default();
        mouth.repeat(3);
        mouth.set(4, 0.5);
        mouth.repeat(5);
        mouth.repeat(8);
        mouth.set(9, 0.25);
        let known: Vec<Option<f32>> =
            mouth.opening.iter().map(|opening| Some(*opening).filter(|o| o.is_finite())).collect();
        assert_eq!((mouth.first, known), (4, vec![Some(0.5), Some(0.5), None, None, None, Some(0.25)]));
    }
}
