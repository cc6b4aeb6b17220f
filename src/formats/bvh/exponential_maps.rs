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
const SMOOTHING: (usize, usize) = (4, 3);

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
