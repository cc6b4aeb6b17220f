//! Split of the captured sources into the parts of a set of rendered persons. No performer and no style is in two
//! parts, except that the one talk of BEAT2, the only capture with complete fingers, is split in time. The first part is
//! for training: it contains only motion whose terms allow that, also commercially. Takes without an entry are not
//! used.

use super::source::MotionSource;
use crate::demo::people::folder::SetPart;

/// Takes of a source in a part.
#[derive(Clone, Copy, Debug)]
pub struct SplitEntry {
    pub source: &'static str,
    pub part: SetPart,
    /// Patterns of names of takes (`*` any characters, `?` one).
    pub takes: &'static [&'static str],
    pub reason: &'static str,
}

const fn entry(
    source: &'static str,
    part: SetPart,
    takes: &'static [&'static str],
    reason: &'static str,
) -> SplitEntry {
    SplitEntry { source, part, takes, reason }
}

/// All entries.
pub const SPLIT: [SplitEntry; 9] = [
    entry("cmu", SetPart::First, &["train_basketball_*"], "free terms; training data of the shipped lifter"),
    entry(
        "cmu",
        SetPart::Middle,
        &["train_directing_traffic_1*"],
        "other activity; partly training data of the lifter",
    ),
    entry("cmu", SetPart::Last, &["test_washwindow_1*"], "other activity; never training data"),
    entry(
        "bandai",
        SetPart::Middle,
        &[
            "dataset-2_raise-*_feminine_*",
            "dataset-2_wave-*_feminine_*",
            "dataset-2_raise-*_normal_*",
            "dataset-2_wave-*_normal_*",
        ],
        "terms: non-commercial; `feminine` was used to choose the lifter's filters",
    ),
    entry(
        "bandai",
        SetPart::Last,
        &[
            "dataset-2_raise-*_elderly_*",
            "dataset-2_wave-*_elderly_*",
            "dataset-2_raise-*_masculine_*",
            "dataset-2_wave-*_masculine_*",
        ],
        "terms: non-commercial; styles that no choice was based on",
    ),
    entry("beat2", SetPart::Middle, &["talk#0"], "terms: non-commercial; first half of the talk"),
    entry("beat2", SetPart::Last, &["talk#1"], "terms: non-commercial; second half, after a gap"),
    entry(
        "ted",
        SetPart::Middle,
        &[
            "3djAkIpp7C0_*",
            "HBpoEMD25Io_*",
            "N-dsHgOl00M_*",
            "WIHcCjrjm_U_*",
            "Wh7-rF4E-Eg_*",
            "_3IOjpSGFqY_*",
            "_J-5LhHbS6o_*",
        ],
        "no terms stated; half of the speakers",
    ),
    entry(
        "ted",
        SetPart::Last,
        &[
            "_lGGkRIpvHM_*",
            "_soZahWpS-0_*",
            "brwBTcacJtI_*",
            "gT7FBJx3Ezs_*",
            "mTok2EyMLvE_*",
            "o1rERZRFyqE_*",
            "pHyi9IZuyF4_*",
        ],
        "no terms stated; the other speakers",
    ),
];

/// Whether a take of a source belongs to a part.
pub fn is_in(source: &MotionSource, part: SetPart, take: &str) -> bool {
    let of_part = SPLIT.iter().filter(|entry| entry.source == source.name() && entry.part == part);
    let mut patterns = of_part.flat_map(|entry| entry.takes).filter_map(|text| glob::Pattern::new(text).ok());
    patterns.any(|pattern| pattern.matches(take))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(source: &MotionSource, take: &str) -> Vec<SetPart> {
        SetPart::ALL.into_iter().filter(|&part| is_in(source, part, take)).collect()
    }

    #[test]
    fn a_take_is_in_one_part_at_most_and_training_motion_is_free() {
        for entry in SPLIT {
            assert!(entry.part != SetPart::First || entry.source == "cmu", "{entry:?}");
            assert!(MotionSource::CAPTURED.iter().any(|source| source.name() == entry.source), "{entry:?}");
            for pattern in entry.takes {
                assert!(glob::Pattern::new(pattern).is_ok());
                // A pattern is also a name that it matches itself.
                let source: MotionSource = entry.source.parse().unwrap();
                assert_eq!(parts(&source, pattern), [entry.part], "{pattern}");
            }
        }
        let of = |take: &str| parts(&MotionSource::Cmu, take);
        assert_eq!(of("train_basketball_signal_3"), [SetPart::First]);
        assert!(of("test_basketball_1").is_empty(), "the activity of the first part");
        assert_eq!(parts(&MotionSource::Bandai, "dataset-2_wave-both-hands_elderly_004"), [SetPart::Last]);
        assert!(parts(&MotionSource::Bandai, "dataset-2_walk_normal_001").is_empty());
    }
}
