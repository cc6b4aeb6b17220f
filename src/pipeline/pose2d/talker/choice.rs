//! Choice of the active speaker of a shot: the mouth that correlates best with the voice, if significantly.

use crate::lip_sync::LipVoiceMatch;
use orator_base::audio::openness::Openness;
use orator_base::types::time::FrameRate;

/// Least confidence of a match; lower than for an audio offset, because there are only a few candidates.
const MIN_CONFIDENCE: f64 = 0.9;
/// Least margin of the best over the second, in correlations times root of seconds (distribution: `SoundOffset`).
const MIN_MARGIN: f64 = 0.15;

pub struct ShotVoice<'a> {
    pub voice: &'a Openness,
    pub fps: FrameRate,
    /// Per frame of the shot: picture time in seconds, and whether there is speech.
    pub time_secs: &'a [f64],
    pub is_speech: &'a [bool],
}

/// Opening of a mouth from frame `first` of the shot; NaN: not detected.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MouthOpening {
    pub first: usize,
    pub opening: Vec<f32>,
}

impl MouthOpening {
    /// Sets the opening of a frame later than all before.
    pub fn set(&mut self, idx: usize, opening: f32) {
        if self.opening.is_empty() {
            self.first = idx;
        }
        self.opening.resize(idx.saturating_sub(self.first), f32::NAN);
        self.opening.push(opening);
    }

    /// Repeats the opening of the previous frame for a repeated frame.
    pub fn repeat(&mut self, idx: usize) {
        if let Some(&opening) = self.opening.last().filter(|_| self.first + self.opening.len() == idx) {
            self.set(idx, opening);
        }
    }

    /// Match with the voice, and confidence that it is not chance; `None` if too few frames could be compared.
    fn match_score(&self, shot: &ShotVoice) -> Option<(f64, f64)> {
        let end = (self.first + self.opening.len()).min(shot.time_secs.len()).min(shot.is_speech.len());
        let frames = self.first.min(end)..end;
        let opening = self.opening.get(..frames.len())?;
        let (time_secs, is_speech) = (&shot.time_secs[frames.clone()], &shot.is_speech[frames]);
        let offset = LipVoiceMatch::new(opening, time_secs, is_speech, shot.voice, shot.fps).offset()?;
        Some((offset.correlation * offset.compared_secs.sqrt(), offset.confidence))
    }
}

/// Index of the mouth that the voice belongs to; `None` if no match is clear.
pub fn find_speaking<'a>(mouths: impl Iterator<Item = &'a MouthOpening>, shot: &ShotVoice) -> Option<usize> {
    let mut match_scores: Vec<(usize, f64, f64)> = mouths
        .enumerate()
        .filter_map(|(at, mouth)| {
            mouth.match_score(shot).map(|(match_score, confidence)| (at, match_score, confidence))
        })
        .collect();
    match_scores.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (at, best, confidence) = *match_scores.first()?;
    let next = match_scores.get(1).map_or(f64::NEG_INFINITY, |(_, match_score, _)| *match_score);
    (confidence >= MIN_CONFIDENCE && best - next >= MIN_MARGIN).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lip_sync::tests::{FPS, Mouth};

    const SECS: f64 = 12.0;

    fn opened(mouth: &Mouth, from: usize) -> MouthOpening {
        let mut opened = MouthOpening::default();
        let (opening, _) = mouth.measured(SECS, 9, 4);
        let known_frames = opening.iter().enumerate().skip(from).filter(|(_, opening)| opening.is_finite());
        known_frames.for_each(|(idx, opening)| opened.set(idx, *opening));
        opened
    }

    fn speaker_of(voice: &Openness, mouths: &[MouthOpening]) -> Option<usize> {
        let time_secs: Vec<f64> = (0..FPS.frames_in(SECS)).map(|t| FPS.secs(t)).collect();
        let is_speech = vec![true; time_secs.len()];
        find_speaking(mouths.iter(), &ShotVoice { voice, fps: FPS, time_secs: &time_secs, is_speech: &is_speech })
    }

    #[test]
    fn the_voice_is_assigned_to_the_matching_mouth() {
        for seed in 0..5 {
            let (first, second) = (Mouth::new(SECS, seed), Mouth::new(SECS, seed + 100));
            let mouths = [opened(&first, 0), opened(&second, 40)];
            assert_eq!(speaker_of(&first.voice(SECS, 0.0), &mouths), Some(0), "{seed}");
            assert_eq!(speaker_of(&second.voice(SECS, 0.1), &mouths), Some(1), "{seed}");
        }
    }

    #[test]
    fn without_a_clear_match_no_speaker_is_chosen() {
        let (first, second, third) = (Mouth::new(SECS, 1), Mouth::new(SECS, 2), Mouth::new(SECS, 3));
        let voice = third.voice(SECS, 0.0);
        assert_eq!(speaker_of(&voice, &[opened(&first, 0), opened(&second, 0)]), None);
        assert_eq!(speaker_of(&voice, &[opened(&third, 0), opened(&third, 0)]), None, "two of one mouth");
        assert_eq!(speaker_of(&voice, &[opened(&third, 150), opened(&first, 0)]), None, "seen for 2 s");
        assert_eq!(speaker_of(&Openness::default(), &[opened(&third, 0)]), None);
        assert_eq!(speaker_of(&voice, &[]), None);
    }

    #[test]
    fn missing_frames_are_nan_and_repeated_ones_are_copied() {
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
