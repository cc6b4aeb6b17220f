//! Validation of model descriptions: existing names, a role that matches the decoding, complete keypoint maps. The
//! file itself is checked in `model`.

use super::TensorAxes;
use super::{Decode, KeypointOutputs, ModelEntry, ModelRole as Role, ModelSource, PictureFit as Fit, SourceFile};
use anyhow::{Result, bail, ensure};
use orator_base::types::file_name::FileName;

impl ModelEntry {
    /// Height and width of the input image.
    pub fn input_size(&self) -> Result<[usize; 2]> {
        let shape = self.inputs.first().map(|port| port.shape.as_slice());
        let (size, channels) = match (self.picture.axes, shape) {
            (TensorAxes::Nchw, Some([1, channels, height, width])) => ([*height, *width], *channels),
            (TensorAxes::Nhwc, Some([1, height, width, channels])) => ([*height, *width], *channels),
            _ => {
                bail!(
                    "the input shape must be [1, 3, height, width] (picture.axes nchw) or [1, height, width, 3] (nhwc)"
                )
            }
        };
        let in_range = channels == 3 && size.iter().all(|side| (1..=4096).contains(side));
        ensure!(
            in_range,
            "the input must have 3 channels and a size of 1 to 4096 px, not {channels} channels and {size:?} px"
        );
        Ok(size.map(|side| side as usize))
    }

    /// Number of keypoints in the decoded output, if its shape states it.
    fn n_points(&self) -> Option<usize> {
        let named = |name: &String| self.outputs.iter().find(|port| port.name == *name);
        let (name, axis, divisor) = match &self.decode {
            Decode::Heatmap { heatmap, .. } => (heatmap, 1, 1),
            Decode::Simcc { x, .. } => (x, 1, 1),
            Decode::Regression { landmarks, .. } => (landmarks, 1, 2),
            _ => return None,
        };
        let size = *named(name)?.shape.get(axis)?;
        usize::try_from(size).ok().map(|size| size / divisor)
    }

    /// Checks the file name, hash, sources and licence.
    pub(crate) fn check_file(&self) -> Result<()> {
        ensure!(
            is_plain_name(&self.file),
            "file must be the plain name of a file in the models folder, not {:?}",
            self.file
        );
        let hex = self.sha256.len() == 64 && self.sha256.bytes().all(|byte| byte.is_ascii_hexdigit());
        ensure!(hex, "sha256 must be 64 hex digits, not {:?}", self.sha256);
        self.sources.iter().try_for_each(ModelSource::check)?;
        ensure!(!self.origin.licence.is_empty(), "origin must name repository, commit, path and licence");
        Ok(())
    }

    /// Checks the description without opening the file.
    pub(crate) fn check(&self) -> Result<()> {
        ensure!(is_plain_name(&self.id), "id must be a plain name, not {:?}", self.id);
        if self.role == Role::Speech {
            return super::speech::check(self);
        }
        if self.role == Role::Recogniser {
            let parts = self.sources.iter().flat_map(|source| &source.files).map(SourceFile::name);
            let mut names = self.files.iter().map(|file| file.path.as_str()).chain(parts);
            let invalid = names.find(|name| !is_plain_name(name));
            ensure!(invalid.is_none(), "files: expected plain names of files, found {:?}", invalid.unwrap_or_default());
            ensure!(!self.files.is_empty(), "files: expected the files of the folder, the weights last");
            return Ok(());
        }
        ensure!(self.files.is_empty(), "files: expected only for the role recogniser");
        ensure!(self.inputs.len() == 1, "inputs must list 1 input, not {}", self.inputs.len());
        let [height, width] = self.input_size()?;
        let numbers = [self.picture.scale].into_iter().chain(self.picture.mean).chain(self.picture.std);
        let is_valid = numbers.clone().all(f64::is_finite) && !self.picture.std.contains(&0.0);
        ensure!(is_valid, "picture: scale, mean and std must be finite, and std not 0");
        for name in self.decode.names() {
            ensure!(
                self.outputs.iter().any(|port| port.name == name),
                "decode refers to the output {name:?}, which outputs does not list"
            );
        }
        self.decode.check()?;
        let is_compatible = match (self.role, &self.fit, &self.decode) {
            (Role::Person, Fit::Letterbox { .. }, Decode::Detections { .. } | Decode::YoloxGrid { .. }) => true,
            (Role::Body, Fit::Box { margin }, Decode::Heatmap { .. } | Decode::Simcc { .. }) => *margin > 0.0,
            (Role::Hand, Fit::Region, Decode::Heatmap { .. } | Decode::Simcc { .. } | Decode::Regression { .. })
            | (Role::Palm, Fit::Letterbox { .. }, Decode::SsdAnchors { .. })
            | (Role::Face, Fit::Region, Decode::Regression { .. }) => height == width,
            (role, ..) => role == Role::Other,
        };
        ensure!(
            is_compatible,
            "incompatible role, fit and decode: expected person: letterbox + detections or yolox-grid; body: box (margin > 0) + \
             heatmap or simcc; hand: region (a square input) + heatmap, simcc or regression; palm: letterbox (a square \
             input) + ssd-anchors; face: region (a square input) + regression"
        );
        let is_complete = |points: &[usize], n: usize| points.len() == n;
        let are_complete = match self.role {
            Role::Body => {
                let hands = [&self.points.left_hand, &self.points.right_hand];
                let none = hands.iter().all(|points| points.is_empty());
                is_complete(&self.points.body, 17) && (none || hands.iter().all(|points| is_complete(points, 21)))
            }
            Role::Hand => is_complete(&self.points.hand, 21),
            _ => true,
        };
        ensure!(
            are_complete,
            "points: a body model needs 17 `body` points (and 21 `left_hand` and 21 `right_hand`, or neither), a hand model 21 `hand` points"
        );
        if let Some(n_points) = self.n_points() {
            let KeypointOutputs { body, hand, left_hand, right_hand } = &self.points;
            let all = [body, hand, left_hand, right_hand].into_iter().flatten();
            if let Some(invalid) = all.clone().find(|point| **point >= n_points) {
                bail!("points: index {invalid} is out of range: the model has {n_points} keypoints");
            }
        }
        Ok(())
    }
}

impl Decode {
    fn names(&self) -> Vec<&str> {
        match self {
            Self::Detections { boxes, labels, .. } => {
                [Some(boxes), labels.as_ref()].into_iter().flatten().map(String::as_str).collect()
            }
            Self::YoloxGrid { predictions, .. } => vec![predictions],
            Self::Heatmap { heatmap, .. } => vec![heatmap],
            Self::Simcc { x, y, .. } => vec![x, y],
            Self::Regression { landmarks, score, right, .. } => {
                [Some(landmarks), Some(score), right.as_ref()].into_iter().flatten().map(String::as_str).collect()
            }
            Self::SsdAnchors { regressors, scores, .. } => vec![regressors, scores],
            Self::None => Vec::new(),
        }
    }

    fn check(&self) -> Result<()> {
        match self {
            Self::Heatmap { blur, .. } => {
                ensure!(blur % 2 == 1 && *blur <= 31, "decode.blur must be odd and at most 31, not {blur}");
            }
            Self::Simcc { split, .. } => {
                ensure!(split.is_finite() && *split > 0.0, "decode.split must be > 0, not {split}");
            }
            Self::YoloxGrid { strides, .. } | Self::SsdAnchors { strides, .. } => {
                ensure!(
                    !strides.is_empty() && !strides.contains(&0),
                    "decode.strides must be integers >= 1, not {strides:?}"
                );
            }
            _ => {}
        }
        Ok(())
    }
}

/// Whether the name is a plain file name without a path.
fn is_plain_name(name: &str) -> bool {
    FileName::new(name).is_ok()
}
