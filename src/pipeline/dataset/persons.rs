//! Checks whether the videos of a speaker show one person, by pairwise comparison of the face shape and the colours of
//! skin and hair, or of the bones where there is no frontal face. Videos are grouped by average linkage. The result is
//! a suggestion for the user: clothes change, light changes colours, and relatives are alike.

use crate::portrait::Portrait;
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, R_ELBOW, R_SHOULDER, R_WRIST};
use orator_dataset::bones::VideoBones;
use std::path::Path;

/// Largest number of videos to compare; more are subsampled evenly.
const MAX_VIDEOS: usize = 200;
/// Least number of frames for a known face shape.
const MIN_FRAMES: usize = 3;
/// Face difference, in thousandths of the face size, of two persons, and that of an 8-bit step of colour distance.
const FACE_THRESHOLD: f64 = 40.0;
const COLOUR_STEP: f64 = 0.5;
/// Bone difference of two different persons, as log ratio of shoulder width to arm length; for one person it varies by
/// up to 0.02 between videos.
const BONES_THRESHOLD: f64 = 0.04;

#[derive(Clone, Debug)]
pub struct VideoPerson {
    pub unit: Unit,
    pub file: String,
    portrait: Option<Portrait>,
    /// Log ratio of shoulder width to arm length; `None`: not measured.
    shoulders: Option<f64>,
}

impl VideoPerson {
    /// Reads the outputs of the stages for a video; missing ones are not compared.
    pub fn read(work: &Path, unit: &Unit) -> Self {
        let bones = VideoBones::read(&Artifact::Bones.path(work, unit)).unwrap_or_default();
        let length = |joint: usize| bones.lengths_metres.get(joint - 1).copied().unwrap_or(0.0);
        let sum = |joints: &[usize]| joints.iter().map(|joint| length(*joint)).sum::<f64>();
        let ratio = sum(&[L_SHOULDER, R_SHOULDER]) / sum(&[L_ELBOW, L_WRIST, R_ELBOW, R_WRIST]);
        let portrait = Portrait::read(&Artifact::Portrait.path(work, unit)).ok();
        Self {
            unit: unit.clone(),
            file: unit.source.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            portrait: portrait.filter(|portrait| portrait.n_frames >= MIN_FRAMES),
            shoulders: Some(ratio.ln()).filter(|ratio| bones.n_frames > 0 && ratio.is_finite()),
        }
    }

    /// Normalised difference of two videos; above 1 they more likely show two persons. `None`: not comparable.
    fn difference(&self, other: &Self) -> Option<f64> {
        let by_face = || {
            let (a, b) = (self.portrait.as_ref()?, other.portrait.as_ref()?);
            Some((a.face_distance(b)? + COLOUR_STEP * a.colour_distance(b)) / FACE_THRESHOLD)
        };
        let by_bones = || Some((self.shoulders? - other.shoulders?).abs() / BONES_THRESHOLD);
        by_face().or_else(by_bones)
    }
}

/// Groups the videos by person, largest group first. A video that cannot be compared is added to the first group.
pub fn groups(videos: &[VideoPerson]) -> Vec<Vec<&VideoPerson>> {
    let step = videos.len().div_ceil(MAX_VIDEOS).max(1);
    let compared: Vec<&VideoPerson> = videos.iter().step_by(step).collect();
    let difference = |a: &VideoPerson, b: &VideoPerson| a.difference(b).filter(|_| a.unit != b.unit);
    let is_known = |one: &&VideoPerson| compared.iter().any(|other| difference(one, other).is_some());
    let (known, unknown): (Vec<&VideoPerson>, Vec<&VideoPerson>) = compared.iter().copied().partition(is_known);
    let mut groups = cluster(&known, difference);
    groups.sort_by_key(|group| std::cmp::Reverse(group.len()));
    match groups.first_mut() {
        Some(first) => first.extend(unknown),
        None => groups.extend(Some(unknown).filter(|unknown| !unknown.is_empty())),
    }
    groups
}

/// Agglomerative clustering with average linkage: merges the two closest groups while their mean difference is below 1.
fn cluster<'a, T>(items: &[&'a T], difference: impl Fn(&T, &T) -> Option<f64>) -> Vec<Vec<&'a T>> {
    let mut groups: Vec<Vec<&T>> = items.iter().map(|item| vec![*item]).collect();
    // Sum and number of the known differences between two groups.
    let known = |a: &T, b: &T| difference(a, b).map_or([0.0; 2], |difference| [difference, 1.0]);
    let mut sums: Vec<Vec<[f64; 2]>> = items.iter().map(|a| items.iter().map(|b| known(a, b)).collect()).collect();
    loop {
        let mean = |i: usize, j: usize| sums[i][j][0] / sums[i][j][1];
        let pairs = (0..groups.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
        let near = pairs.filter(|(i, j)| mean(*i, *j) < 1.0);
        let nearest = near.min_by(|a, b| mean(a.0, a.1).total_cmp(&mean(b.0, b.1)));
        let Some((i, j)) = nearest else { return groups };
        let members = groups.swap_remove(j);
        groups[i].extend(members);
        let row = sums.swap_remove(j);
        sums[i].iter_mut().zip(row).for_each(|(to, from)| *to = [to[0] + from[0], to[1] + from[1]]);
        for row in &mut sums {
            let from = row.swap_remove(j);
            row[i] = [row[i][0] + from[0], row[i][1] + from[1]];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn person(file: &str, face: Option<f64>, shoulders: Option<f64>) -> VideoPerson {
        let vertex = |k: u32, long: f64| [f64::from(k % 5), long * f64::from(k / 5), f64::from(k % 3)];
        let face = face.map(|long| (0..40).map(|k| vertex(k, long)).collect());
        let unit = Unit { speaker: "s".into(), video: file.into(), source: file.into() };
        let portrait = face.map(|face| Portrait { face, n_frames: 9, ..Portrait::default() });
        VideoPerson { unit, file: file.into(), portrait, shoulders }
    }

    fn files(persons: &[VideoPerson]) -> Vec<String> {
        let name = |group: &Vec<&VideoPerson>| {
            let mut files: Vec<&str> = group.iter().map(|one| one.file.as_str()).collect();
            files.sort_unstable();
            files.concat()
        };
        groups(persons).iter().map(name).collect()
    }

    #[test]
    fn videos_are_grouped_by_person() {
        let same = [person("a", Some(1.0), None), person("b", Some(1.001), Some(-0.4)), person("d", Some(1.002), None)];
        assert_eq!(files(&same), ["abd"]);
        let other = person("c", Some(2.0), None);
        assert_eq!(files(&[same.to_vec(), vec![other]].concat()), ["abd", "c"]);
        // Without a face, the bones are compared if both are known.
        let seated = [person("e", None, Some(-0.39)), person("f", None, Some(-0.5)), person("g", None, None)];
        assert_eq!(files(&[same.to_vec(), seated.to_vec()].concat()), ["abdeg", "f"]);
        assert_eq!(files(&seated[2..]), ["g"]);
        assert!(groups(&[]).is_empty());
    }
}
