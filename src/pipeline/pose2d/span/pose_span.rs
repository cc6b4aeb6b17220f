//! Result of a span of a video, its file, and the joining of spans. Tracking restarts at a span; as at a cut, box and
//! colours decide whether the span continues the previous identity.

use super::keypoint_frames::KeypointFrames;
use crate::pose2d::face::views::PortraitViews;
use crate::pose2d::speaker::{TrackedPerson, is_same_person};
use anyhow::{Context, Result, ensure};
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::{Report, workdir};
use orator_base::text::counted;
use orator_base::types::pose2d::Keypoint;
use orator_base::types::time::FrameRate;
use orator_formats::keypoints_npz;
use orator_media::opencv::png;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

/// Results of one span, or of several joined ones.
#[derive(Default, Serialize, Deserialize)]
pub struct PoseSpan {
    pub frames: KeypointFrames,
    /// Number of shots with several people, and of those that follow the active speaker; `None`: the largest person is.
    pub followed: Option<[usize; 2]>,
    pub portrait: PortraitViews,
    /// Width and height of the picture, px.
    pub image_size: [u32; 2],
    /// Number of identities so far.
    pub n_identities: i64,
    /// The first identity, when first recognised, and the last.
    pub first: Option<TrackedPerson>,
    pub last: Option<TrackedPerson>,
}

impl PoseSpan {
    /// Reads the file of a span of `n_frames` in `folder`. The content is validated, since a malicious video may have
    /// compromised the process that wrote it.
    ///
    /// # Errors
    /// A missing file, or one that does not contain such a span.
    pub fn read(folder: &Path, n_frames: usize) -> Result<Self> {
        let path = Artifact::PoseSpan.within(folder);
        let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let no_span = || format!("{} is not a file of keypoints of {n_frames} frames", path.display());
        let span: Self = rmp_serde::from_slice(&bytes).with_context(no_span)?;
        ensure!(span.frames.n_frames() == n_frames && span.portrait.is_valid(), no_span());
        Ok(span)
    }

    /// Writes the file of a span into `folder`.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        workdir::write_file(&Artifact::PoseSpan.within(folder), &rmp_serde::to_vec(self)?)
    }

    pub fn append(&mut self, next: Self) {
        let pair = self.last.as_ref().zip(next.first.as_ref());
        let is_same = pair.is_some_and(|(last, first)| is_same_person(last, first));
        let n_before = self.n_identities.saturating_sub(i64::from(is_same));
        self.frames.append(next.frames, n_before);
        self.n_identities = n_before.saturating_add(next.n_identities);
        if let Some(next) = next.followed {
            let before = self.followed.unwrap_or_default();
            self.followed = Some([0, 1].map(|at| before[at].saturating_add(next[at])));
        }
        self.portrait.append(next.portrait);
        self.image_size = next.image_size;
        self.first = self.first.take().or(next.first);
        self.last = next.last;
    }

    /// Writes the files of the complete video into `out`.
    ///
    /// # Errors
    /// Arrays of unequal lengths; a folder that cannot be written.
    pub fn finish(self, fps: FrameRate, out: &Path) -> Result<Report> {
        let report = self.report();
        let (keypoints, extras) = self.frames.finish(fps, self.image_size)?;
        keypoints_npz::write(&Artifact::Keypoints.within(out), &keypoints, &extras)?;
        if let Some((portrait, picture)) = self.portrait.finish() {
            workdir::write_file(&Artifact::Portrait.within(out), &serde_json::to_vec(&portrait)?)?;
            png::write(&Artifact::FacePicture.within(out), &picture)?;
        }
        Ok(report)
    }

    /// Share of the frames in which each part of the speaker was detected.
    fn report(&self) -> Report {
        let any = |points: &[Keypoint]| points.iter().any(|point| point.score > 0.0);
        let n_frames = self.frames.n_frames();
        let person = self.frames.share(|pose| any(&pose.body));
        let left_hand = self.frames.share(|pose| any(&pose.left_hand));
        let right_hand = self.frames.share(|pose| any(&pose.right_hand));
        let [body, left, right] = [person, left_hand, right_hand].map(|share| format!("{:.0} %", 100.0 * share));
        let mut line =
            format!("{}: person in {body}, left hand {left}, right hand {right}", counted(n_frames, "frame"));
        let mut facts = json!({
            "n_frames": n_frames, "person": person, "left_hand": left_hand, "right_hand": right_hand,
            "several_persons": self.frames.share(|pose| pose.n_persons > 1),
            "mouth": self.frames.share(|pose| pose.face.is_some()),
        });
        if let Some([several, speaking]) = self.followed {
            facts["followed"] = json!({ "several": several, "speaking": speaking });
            if several > speaking {
                let (shots, rest) = (counted(several, "shot"), several - speaking);
                let _ = write!(
                    line,
                    "; several persons in {shots}; in {rest} of them no mouth clearly matches the voice, so the \
                     largest person is followed"
                );
            }
        }
        Report { line, facts: facts.as_object().cloned().unwrap_or_default() }
    }
}
