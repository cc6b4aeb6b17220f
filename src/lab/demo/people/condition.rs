//! Conditions under which people are rendered: each fixes what it is about and leaves the rest to chance.

use anyhow::{Result, bail};

/// What a clip is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Condition {
    /// Half a body from the front.
    Front,
    /// Half a body from 25 to 50 degrees aside.
    ThreeQuarter,
    /// The whole body on its legs.
    Standing,
    /// Behind a desk, hands on it or under it.
    SeatedDesk,
    /// On a chair, legs seen.
    SeatedChair,
    /// Hands interlaced or stacked between gestures.
    HandsFolded,
    /// Hands that cross before the body, arms crossed.
    Crossing,
    /// Wide gestures up to the left and right border of the picture.
    Edge,
    /// Head and shoulders: hands are mostly below the picture.
    Outside,
    /// A pen, cup, phone or sheet in one hand.
    Holding,
    /// Fast gestures with motion blur.
    Fast,
    /// Little light, noise of the sensor.
    Dark,
    /// A lens out of focus.
    Blurred,
    /// A figure that is small in the picture.
    Small,
    /// A low bit rate.
    Compressed,
    /// A picture higher than wide.
    Portrait,
    /// A second, silent person who gestures too.
    TwoPeople,
    /// Behind a desk, the trunk leant ahead, the head bowed, elbows and hands further ahead.
    LeaningDesk,
}

impl Condition {
    /// All, in the order in which they are drawn.
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
        Self::TwoPeople,
        Self::LeaningDesk,
    ];

    /// Name on the command line, of its folder and of its speaker.
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
            Self::TwoPeople => "two-people",
            Self::LeaningDesk => "leaning-desk",
        }
    }

    /// Conditions of a list of names, in the order of `ALL`, each once; an empty list is all of them.
    ///
    /// # Errors
    /// A name that is none: the message lists the names.
    pub fn of_names(names: &[String]) -> Result<Vec<Self>> {
        for name in names {
            if !Self::ALL.iter().any(|condition| condition.name() == name) {
                let known: Vec<&str> = Self::ALL.iter().map(|condition| condition.name()).collect();
                bail!("`{name}` is no condition; conditions are {}", known.join(", "));
            }
        }
        let named = |condition: &Self| names.is_empty() || names.iter().any(|name| name == condition.name());
        Ok(Self::ALL.into_iter().filter(named).collect())
    }

    /// What the body rests on, where the condition fixes it.
    pub fn seat(self) -> Option<Seat> {
        match self {
            Self::Standing => Some(Seat::Standing),
            Self::SeatedDesk | Self::LeaningDesk => Some(Seat::Desk),
            Self::SeatedChair => Some(Seat::Chair),
            _ => None,
        }
    }

    /// How the hands move.
    pub fn manner(self) -> Manner {
        match self {
            Self::HandsFolded => Manner::Folded,
            Self::Crossing => Manner::Crossing,
            Self::Edge => Manner::Wide,
            Self::Outside => Manner::Low,
            Self::Holding => Manner::Holding,
            Self::Fast => Manner::Fast,
            _ => Manner::Free,
        }
    }

    /// What the picture shows, and from where.
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
            Self::TwoPeople => Framing { yaw_degrees: [0.0, 15.0], below_neck: [0.6, 0.8], ..half },
            _ => half,
        }
    }
}

/// What a body rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seat {
    Standing,
    Chair,
    /// A chair behind a desk.
    Desk,
}

/// How hands move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Manner {
    Free,
    Folded,
    Crossing,
    Wide,
    Low,
    Holding,
    Fast,
}

/// Ranges of what a camera shows; lengths are shares of the body's unit (`Build::unit`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// Least and most angle beside the body's front.
    pub yaw_degrees: [f64; 2],
    /// Lower border of the picture below the neck.
    pub below_neck: [f64; 2],
    /// Upper border above the crown of the head.
    pub above_head: [f64; 2],
    /// Horizontal angle of view.
    pub fov_degrees: [f64; 2],
    /// Widths and heights, px, all even.
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
