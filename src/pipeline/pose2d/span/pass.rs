//! Processing of a span: its frames at the dataset rate pass in order through a `Chain`, which restarts at each shot.
//! Repeated frames reuse the previous result. To follow the active speaker, a `TalkerSearch` processes the span first.

use super::PoseSpan;
use super::video_frames::VideoFrames;
use crate::pose2d::Chain;
use crate::pose2d::chosen_person::ChosenPerson;
use crate::pose2d::talker::TalkerSearch;
use crate::pose2d::talker::choice::ShotVoice;
use crate::pose2d::talker::search::ShotTalker;
use crate::{lip_sync, sound};
use anyhow::{Context, Result};
use orator_base::stage::progress::{Event, Progress, Task};
use orator_base::types::pose2d::Pose2d;
use std::path::Path;
use std::time::Instant;

/// Number of frames after which the estimate of the processing time is reported.
const ESTIMATE_AFTER_FRAMES: usize = 150;

/// Estimates the poses in the frames of `video`. `talkers` are the active speakers of its shots, if they were searched,
/// and `chosen` the persons whom users chose; the last of several choices for a frame counts.
///
/// # Errors
/// A video that cannot be read; a model that fails.
pub fn estimate_poses(
    video: &VideoFrames,
    mut chain: Chain,
    talkers: Option<&[ShotTalker]>,
    chosen: &[ChosenPerson],
    progress: &dyn Progress,
    task: &dyn Task,
) -> Result<PoseSpan> {
    let mut paths = talkers.unwrap_or_default().iter().map(|shot| shot.path.clone());
    let corner = video.media.active_area.map_or([0; 2], |area| [area.x, area.y]);
    let (start, n_frames) = (Instant::now(), video.timeline.n_frames());
    let mut span = PoseSpan::default();
    let (mut pose, mut choice) = (Pose2d::default(), None);
    span.image_size = video.each(|time, begins_shot, picture| {
        let idx = time.frame_idx;
        if begins_shot {
            chain.begin_shot(paths.next().flatten());
        }
        let now = chosen.iter().rposition(|(frames, _)| frames.contains(&idx));
        if now != choice {
            // After its first frame, the point is no longer where the person is.
            let begun = now.map(|at| &chosen[at]).filter(|(frames, _)| frames.start == idx);
            chain.follow(begun.map(|(_, point)| [0, 1].map(|k| point[k] - corner[k] as f32)));
            choice = now;
        }
        if let Some(picture) = picture {
            let estimated = chain.frame(&picture).with_context(|| format!("frame {idx}"))?;
            if let Some(points) = chain.face_points() {
                span.portrait.add(&picture, points, time.source_secs)?;
            }
            pose = estimated.moved(corner);
        }
        if idx + 1 == ESTIMATE_AFTER_FRAMES && n_frames >= 6 * ESTIMATE_AFTER_FRAMES {
            let hours = start.elapsed().as_secs_f64() / (ESTIMATE_AFTER_FRAMES as f64 / video.fps.per_sec());
            let line = format!("one hour of video takes about {hours:.1} h on this machine with one job");
            progress.event(&Event::Estimate { line: &line });
        }
        span.frames.push(pose.clone(), time.source_secs);
        task.advance(1);
        Ok(())
    })?;
    (span.n_identities, [span.first, span.last]) = chain.identities();
    span.followed = talkers.map(|shots| {
        let n_several = shots.iter().filter(|shot| shot.several).count();
        [n_several, shots.iter().filter(|shot| shot.path.is_some()).count()]
    });
    Ok(span)
}

/// Finds the active speaker of each shot of `video`, using its audio file `sound`.
///
/// # Errors
/// A video or audio that cannot be read; a model that fails.
pub fn talkers(
    video: &VideoFrames,
    sound: &Path,
    mut search: TalkerSearch,
    task: &dyn Task,
) -> Result<Vec<ShotTalker>> {
    let (_, sound_db) = sound::levels(sound, video.fps, video.timeline.n_frames())?;
    let is_speech: Vec<bool> = sound_db.iter().map(|&db| lip_sync::is_speech(f32::NAN, db)).collect();
    let voice = sound::openness(sound)?;
    let (mut talkers, mut time_secs) = (Vec::new(), Vec::new());
    let mut end_shot = |search: &mut TalkerSearch, time_secs: &mut Vec<f64>, end: usize| {
        let is_speech = &is_speech[end - time_secs.len()..end];
        talkers.push(search.end_shot(&ShotVoice { voice: &voice, fps: video.fps, time_secs, is_speech }));
        time_secs.clear();
    };
    video.each(|time, begins_shot, picture| {
        let idx = time.frame_idx;
        if begins_shot && idx > video.span.start {
            end_shot(&mut search, &mut time_secs, idx);
        }
        search.frame(picture.as_ref()).with_context(|| format!("frame {idx}"))?;
        time_secs.push(time.source_secs);
        task.advance(1);
        Ok(())
    })?;
    end_shot(&mut search, &mut time_secs, video.span.end);
    Ok(talkers)
}
