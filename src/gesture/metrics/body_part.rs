//! Parts of the body: the points of a metric, and the origins of their coordinates.

use orator_base::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, NECK, R_HAND, R_SHOULDER, R_WRIST, is_duplicate};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyPart {
    /// The 48 joints without the neck, including the two hand roots, which duplicate the wrists.
    All,
    /// All 49 joints, including the neck, which is static.
    WithNeck,
    /// Shoulders, elbows, wrists: joints 1 to 6.
    Body,
    /// The 40 finger joints: 8 to 48 without 28.
    Hands,
    /// The two wrists: joints 3 and 6.
    Wrists,
    /// The 40 finger joints, each measured from the wrist of its own side.
    FingersFromWrist,
}

/// A joint, and the joint that its position is relative to (`None`: the neck, at the origin).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MeasuredPoint {
    pub joint: usize,
    pub origin: Option<usize>,
}

impl BodyPart {
    pub const fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::WithNeck => "all_and_neck",
            Self::Body => "body",
            Self::Hands => "hands",
            Self::Wrists => "wrists",
            Self::FingersFromWrist => "fingers_from_wrist",
        }
    }

    pub fn joints(self) -> Vec<usize> {
        match self {
            Self::All => (NECK + 1..N_JOINTS).collect(),
            Self::WithNeck => (0..N_JOINTS).collect(),
            Self::Body => (R_SHOULDER..=L_WRIST).collect(),
            Self::Hands | Self::FingersFromWrist => (L_HAND..N_JOINTS).filter(|joint| !is_duplicate(*joint)).collect(),
            Self::Wrists => vec![R_WRIST, L_WRIST],
        }
    }

    /// Joints of the part with their origins.
    pub(crate) fn points(self) -> Vec<MeasuredPoint> {
        let origin = |joint| match self {
            Self::FingersFromWrist if joint < R_HAND => Some(L_WRIST),
            Self::FingersFromWrist => Some(R_WRIST),
            _ => None,
        };
        self.joints().into_iter().map(|joint| MeasuredPoint { joint, origin: origin(joint) }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_their_documented_joints() {
        let n = |part: BodyPart| part.joints().len();
        assert_eq!(
            [BodyPart::All, BodyPart::WithNeck, BodyPart::Body, BodyPart::Hands, BodyPart::Wrists].map(n),
            [48, 49, 6, 40, 2]
        );
        let fingers = BodyPart::FingersFromWrist.points();
        assert!(fingers.contains(&MeasuredPoint { joint: 8, origin: Some(L_WRIST) }));
        assert!(fingers.contains(&MeasuredPoint { joint: 29, origin: Some(R_WRIST) }));
    }
}
