//! Keypoint statistics that need no ground truth, for comparing rendered clips with real ones: scores, jitter,
//! detected hands, and the distance between the wrists of the hand and the body model.

use super::grid::{Grid, number, percent};
use super::points::{GROUPS, share};
use anyhow::{Result, ensure};
use ndarray::ArrayView3;
use orator_base::math::order::{Ordered, median};
use orator_base::stage::artifacts::Artifact;
use orator_base::types::pose2d::{HAND_VISIBLE_SCORE, Keypoints, VISIBLE_SCORE, coco};
use orator_dataset::config;
use orator_formats::keypoints_npz;
use serde::Serialize;
use std::path::Path;

/// Number of groups of `points::GROUPS` that are evaluated: face, shoulders, elbows, wrists.
const N_GROUPS: usize = 4;

/// Keypoint statistics over clips. Lengths are relative to a clip's median shoulder distance in the image.
#[derive(Clone, Debug, Serialize)]
pub struct KeypointStatistics {
    /// Name of the configuration, and number of clips with keypoints.
    pub name: String,
    pub n_clips: usize,
    /// Median score, 0..1, and median second difference in time, of face, shoulders, elbows and wrists.
    pub scores: [f64; N_GROUPS],
    pub jitter: [f64; N_GROUPS],
    /// Share of the frames with a hand, per side, 0..1, and the median second difference of its points relative to its
    /// wrist.
    pub hands: f64,
    pub hand_jitter: f64,
    /// Median distance of the hand's wrist from the body's.
    pub wrist_distance: f64,
}

/// Statistics of the keypoints of a configuration's videos; videos without keypoints are skipped.
///
/// # Errors
/// No video has keypoints.
pub fn of_config(config_file: &Path) -> Result<KeypointStatistics> {
    let config = config::load(config_file, &[])?;
    let units = config::videos::all(&config).into_iter().flat_map(|videos| videos.units);
    let files =
        units.map(|unit| Artifact::Keypoints.path(&config.settings.work.dir, &unit)).filter(|path| path.is_file());
    let clips = files.map(|path| keypoints_npz::read(&path)).collect::<Result<Vec<_>>>()?;
    ensure!(
        !clips.is_empty(),
        "no video of {} has keypoints; run `orator run -c {} --to pose2d`",
        config_file.display(),
        config_file.display()
    );
    let name = config_file.file_stem().unwrap_or_default().to_string_lossy();
    Ok(measure(&name, &clips))
}

fn measure(name: &str, clips: &[Keypoints]) -> KeypointStatistics {
    let mut scores: [Vec<f64>; N_GROUPS] = Default::default();
    let mut jitter: [Vec<f64>; N_GROUPS] = Default::default();
    let (mut hand_jitter, mut wrist_distances) = (Vec::new(), Vec::new());
    let (mut n_hands, mut n_frames) = (0, 0);
    for clip in clips {
        let width = |t: usize| {
            let at = |point: usize, k: usize| clip.body[[t, point, k]];
            let found = at(coco::L_SHOULDER, 2).min(at(coco::R_SHOULDER, 2)) > VISIBLE_SCORE;
            let [dx, dy] = [0, 1].map(|k| at(coco::L_SHOULDER, k) - at(coco::R_SHOULDER, k));
            found.then(|| f64::from(dx.hypot(dy)))
        };
        let Some(shoulders) = median((0..clip.n_frames()).filter_map(width)).filter(|width| *width > 1.0) else {
            continue;
        };
        for (group, (_, points)) in GROUPS.iter().take(N_GROUPS).enumerate() {
            for &point in *points {
                scores[group].extend((0..clip.n_frames()).map(|t| f64::from(clip.body[[t, point, 2]])));
                jitter[group]
                    .extend(second_differences(clip.body.view(), point, None, VISIBLE_SCORE).map(|d| d / shoulders));
            }
        }
        for (hand, wrist) in [(&clip.left_hand, coco::L_WRIST), (&clip.right_hand, coco::R_WRIST)] {
            n_frames += clip.n_frames();
            for t in 0..clip.n_frames() {
                if hand[[t, 0, 2]] < HAND_VISIBLE_SCORE {
                    continue;
                }
                n_hands += 1;
                if clip.body[[t, wrist, 2]] > VISIBLE_SCORE {
                    let [dx, dy] = [0, 1].map(|k| hand[[t, 0, k]] - clip.body[[t, wrist, k]]);
                    wrist_distances.push(f64::from(dx.hypot(dy)) / shoulders);
                }
            }
            for point in 1..hand.shape()[1] {
                let differences = second_differences(hand.view(), point, Some(0), HAND_VISIBLE_SCORE);
                hand_jitter.extend(differences.map(|d| d / shoulders));
            }
        }
    }
    let middle = |values: Vec<f64>| Ordered::new(values).quantile(0.5).unwrap_or(f64::NAN);
    KeypointStatistics {
        name: name.to_owned(),
        n_clips: clips.len(),
        scores: scores.map(middle),
        jitter: jitter.map(middle),
        hands: share(n_hands, n_frames),
        hand_jitter: middle(hand_jitter),
        wrist_distance: middle(wrist_distances),
    }
}

/// Lengths of the second differences in time of a point, optionally relative to another point, over frame triples in
/// which all are present.
fn second_differences(
    points: ArrayView3<f32>,
    point: usize,
    about: Option<usize>,
    min_score: f32,
) -> impl Iterator<Item = f64> {
    let at = move |t: usize, k: usize| points[[t, point, k]] - about.map_or(0.0, |root| points[[t, root, k]]);
    let found =
        move |t: usize| points[[t, point, 2]] > min_score && about.is_none_or(|root| points[[t, root, 2]] > min_score);
    let middle = 1..points.shape()[0].saturating_sub(1).max(1);
    let lengths: Vec<f64> = middle
        .filter(|&t| found(t - 1) && found(t) && found(t + 1))
        .map(|t| {
            let [dx, dy] = [0, 1].map(|k| at(t - 1, k) - 2.0 * at(t, k) + at(t + 1, k));
            f64::from(dx.hypot(dy))
        })
        .collect();
    lengths.into_iter()
}

/// Grid of the statistics, one row per configuration.
pub fn grid(statistics: &[KeypointStatistics]) -> Grid {
    let names = |what: &str| GROUPS.iter().take(N_GROUPS).map(|(name, _)| format!("{what} {name}")).collect::<Vec<_>>();
    let mut heads = vec!["clips".to_owned()];
    heads.extend(names("score"));
    heads.extend(names("jitter"));
    heads.extend(["hands", "jitter fingers", "wrist distance"].map(str::to_owned));
    let row = |row: &KeypointStatistics| {
        let mut cells = vec![row.n_clips.to_string()];
        cells.extend(row.scores.map(|score| number(score, 2)));
        cells.extend(row.jitter.map(percent));
        cells.extend([row.hands, row.hand_jitter, row.wrist_distance].map(percent));
        (row.name.clone(), cells)
    };
    Grid {
        title: "keypoints without ground truth",
        note: "Median scores; jitter: median second difference in time; % of hands detected; median distance between \
               the wrists of hand and body model. Lengths in % of the shoulder distance in the image.",
        heads,
        rows: statistics.iter().map(row).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::people::clips::tests::exact;

    #[test]
    fn a_shake_is_jitter_and_a_shifted_hand_has_a_wrist_distance() {
        let mut clip = exact().keypoints;
        let steady = measure("steady", std::slice::from_ref(&clip));
        for t in 0..clip.n_frames() {
            clip.body[[t, coco::L_ELBOW, 0]] += if t % 2 == 0 { 2.0 } else { -2.0 };
            clip.body[[t, coco::R_ELBOW, 0]] += if t % 2 == 0 { 2.0 } else { -2.0 };
        }
        let wrist = clip.right_hand[[0, 0, 0]] - clip.body[[0, coco::R_WRIST, 0]];
        assert!(wrist.abs() < 1e-3);
        clip.left_hand.slice_mut(ndarray::s![.., .., 0]).mapv_inplace(|x| x + 30.0);
        clip.right_hand.slice_mut(ndarray::s![.., .., 0]).mapv_inplace(|x| x + 30.0);
        let shaken = measure("shaken", &[clip]);
        let shoulders = 800.0 * 0.36 / 2.0;
        assert!((shaken.jitter[2] - 8.0 / shoulders).abs() < 0.01, "{shaken:?}");
        assert!((shaken.wrist_distance - 30.0 / shoulders).abs() < 0.01 && steady.wrist_distance < 1e-3);
        assert!((shaken.hand_jitter - steady.hand_jitter).abs() < 1e-4 && shaken.hands == 1.0);
    }
}
