//! A performance as one JSON object: `format` "orator motion", `version` 1, `fps` [numerator, denominator], `n_frames`,
//! `units`, `axes`; `names`, `parents` (index or null) and `offsets` (from the parent in T-pose) of the joints, bone
//! ends included; `joints49`, the joint index of each of a motion's 49 joints; `positions` [frame][joint][x, y, z] to
//! 1e-6 m, soles at y = 0; `rotations` [frame][joint][x, y, z, w], unit quaternions relative to the parent, to 1e-7.
//! `posture`: generated angles, `fps`, `head`, `trunk` [frame][yaw, pitch, roll] in radians, null if not modelled;
//! `hidden`: frames [start, end) of each limb that was not detected; `fingers_unusable`: true, or left out.

use crate::animate::performance::Performance;
use crate::animate::rig::names::Names;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::time::FrameRate;
use serde_json::json;
use std::io::{self, Write};

pub fn write(
    text: &mut impl Write,
    performance: &Performance,
    names: Names,
    posture: Option<(FrameRate, &Posture)>,
) -> io::Result<()> {
    let (clip, bones) = (&performance.clip, &performance.clip.skeleton.joints);
    let mut head = json!({
        "format": "orator motion",
        "version": 1,
        "fps": [clip.fps.num, clip.fps.den],
        "n_frames": clip.n_frames(),
        "units": "metres",
        "axes": "x to the figure's left, y up, z forward",
        "names": names.of(&clip.skeleton),
        "parents": bones.iter().map(|bone| bone.parent).collect::<Vec<_>>(),
        "offsets": bones.iter().map(|bone| bone.offset.map(|cm| (cm * 1e4).round() / 1e6)).collect::<Vec<_>>(),
        "joints49": performance.rig.positions.to_vec(),
    });
    let hidden = performance.report.hidden_ranges(clip.n_frames());
    if !hidden.is_empty() {
        head["hidden"] = json!(hidden);
    }
    if performance.report.fingers_unusable {
        head["fingers_unusable"] = json!(true);
    }
    if let Some((fps, posture)) = posture {
        let channel = |channel: PostureChannel| {
            let rows = posture.channel(channel).outer_iter();
            json!(rows.map(|angles| angles.to_vec()).collect::<Vec<_>>())
        };
        head["posture"] = json!({ "fps": [fps.num, fps.den] });
        PostureChannel::ALL.into_iter().for_each(|of| head["posture"][of.name()] = channel(of));
    }
    let head = head.to_string();
    write!(text, "{},\n\"positions\":[", head.strip_suffix('}').unwrap_or(&head))?;
    rows(text, (0..clip.n_frames()).map(|frame| clip.positions(frame)), |_, place: Vec3| {
        let [x, y, z] = place.map(|cm| cm / 100.0);
        format!("[{x:.6},{y:.6},{z:.6}]")
    })?;
    text.write_all(b"],\n\"rotations\":[")?;
    rows(text, clip.local.iter().cloned(), |joint, rotation: Rotation| {
        let Rotation { w, v: [x, y, z] } = if bones[joint].end { Rotation::IDENTITY } else { rotation };
        format!("[{x:.7},{y:.7},{z:.7},{w:.7}]")
    })?;
    text.write_all(b"]}\n")
}

/// Writes one line per frame with the value of `shown` for every joint.
fn rows<T>(
    text: &mut impl Write,
    frames: impl Iterator<Item = Vec<T>>,
    shown: impl Fn(usize, T) -> String,
) -> io::Result<()> {
    for (n, frame) in frames.enumerate() {
        let joints: Vec<String> = frame.into_iter().enumerate().map(|(joint, value)| shown(joint, value)).collect();
        write!(text, "{}\n[{}]", if n == 0 { "" } else { "," }, joints.join(","))?;
    }
    Ok(())
}
