//! Conditions under which persons are rendered: each fixes one aspect and leaves the others random.

use anyhow::{Result, bail};

/// Aspect that a clip tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Condition {
    /// Upper body from the front.
    Front,
    /// Upper body from 25 to 50 degrees to the side.
    ThreeQuarter,
    /// Full body, standing.
    Standing,
    /// Seated behind a desk, hands on it or under it.
    SeatedDesk,
    /// Seated on a chair, legs visible.
    SeatedChair,
    /// Hands interlaced or stacked between gestures.
    HandsFolded,
    /// Hands crossing in front of the body, arms crossed.
    Crossing,
    /// Wide gestures up to the left and right border of the image.
    Edge,
    /// Head and shoulders: hands are mostly below the image.
    Outside,
    /// A pen, cup, phone or sheet in one hand.
    Holding,
    /// Fast gestures with motion blur.
    Fast,
    /// Low light with sensor noise.
    Dark,
    /// Out-of-focus blur.
    Blurred,
    /// A person that is small in the image.
    Small,
    /// Low bit rate.
    Compressed,
    /// Portrait format.
    Portrait,
    /// A second, silent person that gestures too.
    TwoPersons,
    /// Seated behind a desk, trunk leaning forwards, head bowed, elbows and hands further forwards.
    LeaningDesk,
}

impl Condition {
    /// All conditions, in rendering order.
    pub const ALL: [Self; 18] = [
        Self::Front,
        Self::ThreeQuarter,
        Self::Standing,
        Self::SeatedDesk,
        Self::SeatedChair,
        Self::HandsFolded,
        Self::Crossing,
        Self::Edge,
        Self::Outside,
        Self::Holding,
        Self::Fast,
        Self::Dark,
        Self::Blurred,
        Self::Small,
        Self::Compressed,
        Self::Portrait,
        Self::TwoPersons,
        Self::LeaningDesk,
    ];

    /// Name on the command line, and name of the condition's folder and speaker.
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::ThreeQuarter => "three-quarter",
            Self::Standing => "standing",
            Self::SeatedDesk => "seated-desk",
            Self::SeatedChair => "seated-chair",
            Self::HandsFolded => "hands-folded",
            Self::Crossing => "crossing",
            Self::Edge => "edge",
            Self::Outside => "outside",
            Self::Holding => "holding",
            Self::Fast => "fast",
            Self::Dark => "dark",
            Self::Blurred => "blurred",
            Self::Small => "small",
            Self::Compressed => "compressed",
            Self::Portrait => "portrait",
            Self::TwoPersons => "two-people",
            Self::LeaningDesk => "leaning-desk",
        }
    }

    /// Parses a list of names; the result is in the order of `ALL` without duplicates. An empty list means all.
    ///
    /// # Errors
    /// An unknown name; the message lists the known names.
    pub fn of_names(names: &[String]) -> Result<Vec<Self>> {
        for name in names {
            if !Self::ALL.iter().any(|condition| condition.name() == name) {
                let known: Vec<&str> = Self::ALL.iter().map(|condition| condition.name()).collect();
                bail!("unknown condition `{name}`: expected one of {}", known.join(", "));
            }
        }
        let named = |condition: &Self| names.is_empty() || names.iter().any(|name| name == condition.name());
        Ok(Self::ALL.into_iter().filter(named).collect())
    }

    /// Seat of the person, if the condition fixes it.
    pub fn seat(self) -> Option<Seat> {
        match self {
            Self::Standing => Some(Seat::Standing),
            Self::SeatedDesk | Self::LeaningDesk => Some(Seat::Desk),
            Self::SeatedChair => Some(Seat::Chair),
            _ => None,
        }
    }

    /// Style of the hand movements.
    pub fn gesture_style(self) -> GestureStyle {
        match self {
            Self::HandsFolded => GestureStyle::Folded,
            Self::Crossing => GestureStyle::Crossing,
            Self::Edge => GestureStyle::Wide,
            Self::Outside => GestureStyle::Low,
            Self::Holding => GestureStyle::Holding,
            Self::Fast => GestureStyle::Fast,
            _ => GestureStyle::Free,
        }
    }

    /// Camera framing.
    pub fn framing(self) -> Framing {
        let half = Framing {
            yaw_degrees: [0.0, 25.0],
            below_neck: [0.52, 0.78],
            above_head: [0.03, 0.2],
            fov_degrees: [38.0, 62.0],
            sizes: &[[640, 480], [768, 432], [640, 360], [854, 480], [720, 540]],
        };
        match self {
            Self::Front => Framing { yaw_degrees: [0.0, 12.0], ..half },
            Self::ThreeQuarter => Framing { yaw_degrees: [25.0, 50.0], ..half },
            Self::Standing => Framing { below_neck: [1.5, 1.6], sizes: &[[854, 480], [720, 540], [960, 540]], ..half },
            Self::SeatedChair => Framing { below_neck: [0.95, 1.1], sizes: &[[854, 480], [720, 540]], ..half },
            Self::SeatedDesk | Self::LeaningDesk => Framing { below_neck: [0.48, 0.62], ..half },
            Self::HandsFolded => Framing { below_neck: [0.58, 0.75], ..half },
            Self::Edge => Framing {
                yaw_degrees: [0.0, 15.0],
                below_neck: [0.5, 0.6],
                above_head: [0.0, 0.06],
                sizes: &[[540, 540], [640, 560], [600, 480], [640, 480]],
                ..half
            },
            Self::Outside => Framing { below_neck: [0.25, 0.42], ..half },
            Self::Small => {
                Framing { below_neck: [1.6, 2.2], above_head: [0.5, 1.1], sizes: &[[960, 540], [1280, 720]], ..half }
            }
            Self::Portrait => Framing {
                below_neck: [0.7, 1.1],
                sizes: &[[480, 854], [432, 768], [540, 720]],
                fov_degrees: [28.0, 42.0],
                ..half
            },
            Self::TwoPersons => Framing { yaw_degrees: [0.0, 15.0], below_neck: [0.6, 0.8], ..half },
            _ => half,
        }
    }
}

/// Seat of a person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seat {
    Standing,
    Chair,
    /// A chair behind a desk.
    Desk,
}

/// How hands move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestureStyle {
    Free,
    Folded,
    Crossing,
    Wide,
    Low,
    Holding,
    Fast,
}

/// Ranges of the camera framing; lengths in units of the body (`Build::unit`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// Smallest and largest angle from the body's front.
    pub yaw_degrees: [f64; 2],
    /// Distance of the lower image border below the neck.
    pub below_neck: [f64; 2],
    /// Distance of the upper image border above the crown of the head.
    pub above_head: [f64; 2],
    /// Horizontal angle of view.
    pub fov_degrees: [f64; 2],
    /// Image sizes (width, height), px, all even.
    pub sizes: &'static [[usize; 2]],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_name_is_refused_with_the_list() {
        let names = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let error = Condition::of_names(&names(&["front", "rear"])).unwrap_err().to_string();
        assert!(error.contains("`rear`") && error.contains("three-quarter, standing"), "{error}");
        let two = Condition::of_names(&names(&["small", "front", "small"])).unwrap();
        assert_eq!(two, [Condition::Front, Condition::Small]);
        assert_eq!(Condition::of_names(&[]).unwrap().len(), Condition::ALL.len());
    }
}
