//! Motion of a BVH file as the features of FineMotion (Korzun et al. 2020): exponential maps of 15 upper-body joints
//! at 20 frames per second, with fixed hips; and the conversion back to a BVH file with the same skeleton.

use super::read::Bvh;
use super::skeleton::{BvhSkeleton, JointChannels};
use anyhow::{Context, Result, bail, ensure};
use ndarray::{Array2, ArrayView2};
use orator_base::math::rotation::Rotation;
use orator_base::math::savitzky_golay::SavitzkyGolay;
use orator_base::math::vec3::Vec3;
use orator_base::motion::exponential_map::make_continuous;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Joints used as features, named as in the captures of GENEA 2020.
pub const JOINTS: [&str; 15] = [
    "Spine",
    "Spine1",
    "Spine2",
    "Spine3",
    "Neck",
    "Neck1",
    "Head",
    "RightShoulder",
    "RightArm",
    "RightForeArm",
    "RightHand",
    "LeftShoulder",
    "LeftArm",
    "LeftForeArm",
    "LeftHand",
];
pub const FPS: FrameRate = FrameRate::new(20, 1);
/// Columns with a smaller standard deviation in the first file are dropped.
const MIN_STD: f64 = 1e-6;
/// Added to the largest absolute value of a column, which is a divisor.
const EPS: f64 = 1e-8;
/// Half width of the smoothing window in frames, and order of its polynomial.
pub const SMOOTHING: (usize, usize) = (4, 3);

/// Names of the joints in a skeleton other than GENEA's: joint name to the skeleton's own name, or to an empty name
/// if the skeleton has no such joint. Joints that are not listed have GENEA's names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct JointMapping(BTreeMap<String, String>);

impl JointMapping {
    /// Parses entries such as `Spine3=Chest`, or `Spine3=` if the skeleton has no such joint.
    ///
    /// # Errors
    ///
    /// An entry of another form, or for a joint that is not in [`JOINTS`].
    pub fn parse(entries: &[String]) -> Result<Self> {
        let entry = |entry: &String| {
            let (joint, name) = entry.split_once('=').with_context(|| format!("`{entry}`: expected JOINT=NAME"))?;
            ensure!(JOINTS.contains(&joint), "unknown joint `{joint}`: expected one of {}", JOINTS.join(", "));
            Ok((joint.to_owned(), name.to_owned()))
        };
        Ok(Self(entries.iter().map(entry).collect::<Result<_>>()?))
    }

    /// Indices of the feature joints, in reverse skeleton order (the order of FineMotion's columns).
    fn find(&self, skeleton: &BvhSkeleton) -> Result<Vec<usize>> {
        let names = || skeleton.joints.iter().map(|joint| joint.name.as_str());
        let mut found = Vec::new();
        for joint in JOINTS {
            let name = self.0.get(joint).map_or(joint, String::as_str);
            if name.is_empty() {
                continue;
            }
            let Some(at) = names().position(|other| other == name) else {
                bail!(
                    "the skeleton has no joint {name}; map it with `{joint}=NAME`, or omit it with `{joint}=`. \
                     Its joints: {}",
                    names().collect::<Vec<_>>().join(", ")
                );
            };
            ensure!(!found.contains(&at), "joint {name} is mapped to two joints");
            found.push(at);
        }
        ensure!(!found.is_empty(), "every joint is omitted: expected at least one");
        found.sort_unstable_by(|a, b| b.cmp(a));
        Ok(found)
    }
}

/// Conversion between the motion of one skeleton and features.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExponentialMaps {
    pub skeleton: BvhSkeleton,
    /// Channel values outside the features: the first frame of the first file, with the root channels at 0.
    rest: Vec<f64>,
    joints: Vec<usize>,
    /// Columns used as features, out of three for each of `joints`, with mean and largest absolute value of each.
    columns: Vec<usize>,
    mean: Vec<f64>,
    largest: Vec<f64>,
}

impl ExponentialMaps {
    /// Fits the conversion to training files, given with their names; all their exponential maps are held in memory,
    /// but only one file at a time.
    ///
    /// # Errors
    ///
    /// No file; or, with the file name, another skeleton than the first, no frame, non-finite numbers, missing joints.
    pub fn of(files: impl IntoIterator<Item = Result<(String, Bvh)>>, mapping: &JointMapping) -> Result<Self> {
        let mut files = files.into_iter();
        let (name, first) = files.next().context("no training motion was given")??;
        let mut maps = Self::from_first_file(&first, mapping).with_context(|| name.clone())?;
        let mut all = vec![maps.exponential_maps(&first).context(name)?];
        for file in files {
            let (name, bvh) = file?;
            all.push(maps.exponential_maps(&bvh).context(name)?);
        }
        maps.columns = (0..all[0].ncols()).filter(|&column| all[0].column(column).std(0.0) >= MIN_STD).collect();
        ensure!(!maps.columns.is_empty(), "no joint of the training motion moves");
        let n_frames: usize = all.iter().map(Array2::nrows).sum();
        for &column in &maps.columns {
            let values = || all.iter().flat_map(move |file| file.column(column).to_vec());
            maps.mean.push(values().sum::<f64>() / n_frames as f64);
            maps.largest.push(values().fold(0.0, |largest, v| f64::max(largest, v.abs())) + EPS);
        }
        Ok(maps)
    }

    /// Conversion for the skeleton of the first file, without columns.
    fn from_first_file(first: &Bvh, mapping: &JointMapping) -> Result<Self> {
        let skeleton = BvhSkeleton::of(first);
        skeleton.check()?;
        let joints = mapping.find(&skeleton)?;
        let mut rest = first.frames().next().context("the file has no frames")?.to_vec();
        let n_root = skeleton.joints[0].channels.len();
        rest[..n_root].fill(0.0);
        Ok(Self { skeleton, rest, joints, columns: Vec::new(), mean: Vec::new(), largest: Vec::new() })
    }

    /// Number of features per frame.
    pub fn n_columns(&self) -> usize {
        self.columns.len()
    }

    /// Checks that the tables are consistent, which those of a damaged checkpoint may not be.
    pub fn check(&self) -> Result<()> {
        self.skeleton.check()?;
        let n = self.columns.len();
        ensure!(self.mean.len() == n && self.largest.len() == n && n > 0, "the column tables differ in length");
        ensure!(
            self.rest.len() == self.skeleton.n_channels(),
            "the rest pose has {} values, expected {}",
            self.rest.len(),
            self.skeleton.n_channels()
        );
        ensure!(self.columns.iter().all(|&column| column < 3 * self.joints.len()), "a column index is out of range");
        for &joint in &self.joints {
            let order = self.skeleton.joints.get(joint).and_then(|joint| joint.rotation_order());
            ensure!(order.is_some(), "joint {joint} does not have three rotation channels");
        }
        let mut numbers = self.mean.iter().chain(&self.largest).chain(&self.rest);
        ensure!(numbers.all(|v| v.is_finite()), "a value is not finite");
        ensure!(self.largest.iter().all(|v| *v > 0.0), "a value of `largest` is not positive");
        Ok(())
    }

    /// Features of a file [T, columns] at 20 frames per second: less the mean, divided by the largest absolute value.
    pub fn features(&self, bvh: &Bvh) -> Result<Array2<f32>> {
        let all = self.exponential_maps(bvh)?;
        Ok(Array2::from_shape_fn((all.nrows(), self.columns.len()), |(t, i)| {
            ((all[[t, self.columns[i]]] - self.mean[i]) / self.largest[i]) as f32
        }))
    }

    /// Channel values of each frame for features [T, columns]; all others have those of the first file's first frame.
    pub fn channels(&self, features: ArrayView2<f32>) -> Vec<Vec<f64>> {
        let first_channels = self.skeleton.first_channels();
        let at_rest: Vec<Vec3> =
            self.joints.iter().map(|&joint| self.rotation(joint, &self.rest).rotation_vector()).collect();
        let frame = |row: ndarray::ArrayView1<f32>| {
            let mut maps = at_rest.clone();
            for (i, &column) in self.columns.iter().enumerate() {
                maps[column / 3][column % 3] = f64::from(row[i]) * self.largest[i] + self.mean[i];
            }
            let mut channels = self.rest.clone();
            for (&joint, map) in self.joints.iter().zip(maps) {
                let values = &mut channels[first_channels[joint]..];
                self.skeleton.joints[joint].set_rotation(Rotation::from_rotation_vector(map), values);
            }
            channels
        };
        features.outer_iter().map(frame).collect()
    }

    /// BVH file of the skeleton for features [T, columns].
    pub fn to_bvh(&self, features: ArrayView2<f32>) -> String {
        let channels = self.channels(features);
        self.skeleton.to_bvh(FPS, channels.iter().map(Vec::as_slice))
    }

    /// Exponential maps of the feature joints [T, 3 * joints], resampled to 20 frames per second. As in FineMotion,
    /// the last frame of the file is excluded.
    fn exponential_maps(&self, bvh: &Bvh) -> Result<Array2<f64>> {
        let skeleton = BvhSkeleton::of(bvh);
        let is_same = |(a, b): (&JointChannels, &JointChannels)| (&a.name, &a.channels) == (&b.name, &b.channels);
        let are_same = skeleton.joints.iter().zip(&self.skeleton.joints).all(is_same);
        ensure!(
            are_same && skeleton.joints.len() == self.skeleton.joints.len(),
            "the skeleton has other joints or channels than that of the first file ({} joints, expected {})",
            skeleton.joints.len(),
            self.skeleton.joints.len()
        );
        let per_frame = 1.0 / (bvh.frame_secs * FPS.per_sec());
        ensure!(per_frame > 0.99, "the frame rate is {:.2} fps, expected {FPS} or more", 1.0 / bvh.frame_secs);
        let frames: Vec<&[f64]> = bvh.frames().collect();
        if let Some(t) = frames.iter().position(|frame| frame.iter().any(|value| !value.is_finite())) {
            bail!("frame {t} has a non-finite value");
        }
        // Up to the frame before the last one.
        let n = (0..).take_while(|t| (f64::from(*t) * per_frame).round() < frames.len() as f64 - 1.0).count();
        let is_integer_step = (per_frame - per_frame.round()).abs() < 0.01;
        let mut maps = Array2::zeros((n, 3 * self.joints.len()));
        for (i, &joint) in self.joints.iter().enumerate() {
            let name = &self.skeleton.joints[joint].name;
            ensure!(
                self.skeleton.joints[joint].rotation_order().is_some(),
                "joint {name} does not have three rotation channels"
            );
            let rotation = |t: usize| self.rotation(joint, frames[t.min(frames.len() - 1)]);
            let at = |t: usize| {
                let source_frame = t as f64 * per_frame;
                if is_integer_step {
                    return rotation(t * per_frame.round() as usize);
                }
                rotation(source_frame as usize).slerp(rotation(source_frame as usize + 1), source_frame.fract())
            };
            let mut track: Vec<Vec3> = (0..n).map(|t| at(t).rotation_vector()).collect();
            make_continuous(&mut track);
            for (t, vector) in track.iter().enumerate() {
                (0..3).for_each(|k| maps[[t, 3 * i + k]] = vector[k]);
            }
        }
        Ok(maps)
    }

    /// Local rotation of a joint in a frame of channel values.
    fn rotation(&self, joint: usize, frame: &[f64]) -> Rotation {
        let values = &frame[self.skeleton.first_channels()[joint]..];
        self.skeleton.joints[joint].rotation(values).unwrap_or(Rotation::IDENTITY)
    }
}

/// Smooths every column of features [T, columns] with a Savitzky-Golay filter over 9 frames, of order 3.
pub fn smooth(features: &mut Array2<f32>) {
    let filter = SavitzkyGolay::new(SMOOTHING.0, SMOOTHING.1);
    for mut column in features.columns_mut() {
        let values: Vec<Vec3> = column.iter().map(|v| [f64::from(*v), 0.0, 0.0]).collect();
        column.iter_mut().zip(filter.run(&values)).for_each(|(v, smooth)| *v = smooth[0] as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::math::vec3::{norm, sub};

    /// A skeleton with the joints of GENEA plus hips, legs and fingers, whose angles oscillate; channel order as in
    /// the GENEA captures. `legs` scales the motion of the joints that are not features.
    fn captured(n_frames: usize, frame_secs: f64, legs: f64) -> Bvh {
        let six = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation";
        let three = "CHANNELS 3 Zrotation Xrotation Yrotation";
        let mut text = format!("HIERARCHY\nROOT Hips\n{{\nOFFSET 0 90 0\n{six}\n");
        let chain = |names: &[&str], step: &str| -> String {
            let open: String = names.iter().map(|name| format!("JOINT {name}\n{{\nOFFSET {step}\n{three}\n")).collect();
            format!("{open}End Site\n{{\nOFFSET {step}\n}}\n{}", "}\n".repeat(names.len()))
        };
        text += &chain(&["LeftUpLeg", "LeftLeg"], "0 -40 0");
        for name in ["Spine", "Spine1", "Spine2", "Spine3"] {
            text += &format!("JOINT {name}\n{{\nOFFSET 0 12 0\n{three}\n");
        }
        text += &chain(&["Neck", "Neck1", "Head"], "0 8 0");
        text += &chain(&["RightShoulder", "RightArm", "RightForeArm", "RightHand", "RightHandIndex1"], "-20 0 0");
        text += &chain(&["LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand", "LeftHandIndex1"], "20 0 0");
        text += &"}\n".repeat(5);
        text += &format!("MOTION\nFrames: {n_frames}\nFrame Time: {frame_secs}\n");
        let names = Bvh::parse(&text.replace(&format!("Frames: {n_frames}"), "Frames: 0")).unwrap().joints;
        for t in 0..n_frames {
            let mut numbers = vec![0.0; 6];
            for (i, joint) in names.iter().enumerate().skip(1).filter(|(_, joint)| !joint.channels.is_empty()) {
                let is_feature = JOINTS.contains(&joint.name.as_str());
                let wide = if is_feature { 1.0 } else { legs };
                let far = if joint.name == "LeftArm" { 170.0 } else { 35.0 };
                let secs = t as f64 * frame_secs;
                for k in 0..3 {
                    let at = (1.0 + 0.1 * i as f64) * secs + f64::from(k);
                    numbers.push(wide * if k == 1 { 30.0 } else { far } * at.sin());
                }
            }
            let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
            text += &(numbers.join(" ") + "\n");
        }
        Bvh::parse(&text).unwrap()
    }

    fn fitted(files: &[Bvh], mapping: &JointMapping) -> Result<ExponentialMaps> {
        let file = |(i, file): (usize, &Bvh)| Ok((format!("{i}.bvh"), file.clone()));
        ExponentialMaps::of(files.iter().enumerate().map(file), mapping)
    }

    #[test]
    fn round_trip_preserves_joint_positions() {
        let bvh = captured(301, 1.0 / 60.0, 0.0);
        let maps = fitted(std::slice::from_ref(&bvh), &JointMapping::default()).unwrap();
        maps.check().unwrap();
        assert_eq!(maps.n_columns(), 45);
        let first: Vec<&str> =
            maps.joints.iter().take(4).map(|&joint| maps.skeleton.joints[joint].name.as_str()).collect();
        assert_eq!(first, ["LeftHand", "LeftForeArm", "LeftArm", "LeftShoulder"]);
        let features = maps.features(&bvh).unwrap();
        assert_eq!(features.dim(), (100, 45));
        assert!(features.iter().all(|v| v.abs() <= 2.0));
        let back = Bvh::parse(&maps.to_bvh(features.view())).unwrap();
        assert_eq!((back.n_frames, back.joints.len()), (100, bvh.joints.len()));
        let known: Vec<&[f64]> = bvh.frames().step_by(3).collect();
        let mut worst: f64 = 0.0;
        for (t, frame) in back.frames().enumerate() {
            for (a, b) in maps.skeleton.positions(frame).into_iter().zip(maps.skeleton.positions(known[t])) {
                worst = worst.max(10.0 * norm(sub(a, b)));
            }
        }
        assert!(worst < 0.05, "{worst} mm");
    }

    #[test]
    fn hips_and_other_joints_stay_fixed() {
        let bvh = captured(61, 1.0 / 60.0, 1.0);
        let maps = fitted(std::slice::from_ref(&bvh), &JointMapping::default()).unwrap();
        let channels = maps.channels(maps.features(&bvh).unwrap().view());
        let first: Vec<f64> = bvh.frames().next().unwrap().to_vec();
        let knee = maps.skeleton.first_channels()[2];
        for frame in &channels {
            assert_eq!(frame[..6], [0.0; 6]);
            assert_eq!(frame[knee..knee + 3], first[knee..knee + 3]);
        }
        let at_24 = captured(49, 1.0 / 24.0, 0.0);
        let (a, b) = (maps.features(&at_24).unwrap(), maps.features(&captured(121, 1.0 / 60.0, 0.0)).unwrap());
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 0.02, "{a} {b}");
        }
    }

    #[test]
    fn joint_mapping_handles_other_skeletons() {
        let bvh = captured(31, 1.0 / 60.0, 0.0);
        let parse =
            |entries: &[&str]| JointMapping::parse(&entries.iter().map(|e| (*e).to_owned()).collect::<Vec<_>>());
        let fewer = parse(&["Spine3=", "Neck1="]).unwrap();
        assert_eq!(fitted(std::slice::from_ref(&bvh), &fewer).unwrap().n_columns(), 39);
        let error_of =
            |mapping: &JointMapping| format!("{:#}", fitted(std::slice::from_ref(&bvh), mapping).unwrap_err());
        let text = error_of(&parse(&["Spine3=Chest"]).unwrap());
        assert!(
            text.contains("no joint Chest") && text.contains("Spine3=NAME") && text.contains("LeftUpLeg"),
            "{text}"
        );
        assert!(error_of(&parse(&["Spine3=Spine2"]).unwrap()).contains("mapped to two joints"));
        assert!(parse(&["Spine3"]).is_err() && parse(&["Tail=Tail"]).is_err());
        let mut other = bvh.clone();
        other.joints[2].name = "Knee".into();
        let text = format!("{:#}", fitted(&[bvh.clone(), other], &parse(&[]).unwrap()).unwrap_err());
        assert!(text.contains("other joints"), "{text}");
        let mut broken = bvh.clone();
        broken.values[bvh.n_channels + 7] = f64::NAN;
        let text = format!("{:#}", fitted(&[bvh, broken], &parse(&[]).unwrap()).unwrap_err());
        assert!(text.contains("frame 1 ") && text.contains("1.bvh"), "{text}");
    }
}
