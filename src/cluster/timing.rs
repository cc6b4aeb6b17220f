//! Times every stage on this machine: excerpts spread over all videos are processed like videos, with as many jobs.

use super::stage_times::{StageCost, StageTimes};
use crate::plan::{PlannedUnit, settings_hash};
use anyhow::{Context, Result, ensure};
use nix::sys::resource::{UsageWho, getrusage};
use orator_base::stage::artifacts::StageName;
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::progress::{Progress, Silent};
use orator_base::stage::workdir;
use orator_pipeline::process::message::{ExcerptRequest, MediaRequest};
use orator_pipeline::timing::StageTime;
use orator_pipeline::{Pipeline, Selection};
use std::collections::BTreeMap;
use std::path::Path;

/// Share of all video that is timed, and its bounds in seconds.
const SHARE: f64 = 0.1;
const MIN_SECS: f64 = 30.0;
const MAX_SECS: f64 = 120.0;
/// Length of an excerpt, and of the two short ones that determine the fixed cost of a stage, seconds.
const LONG_SECS: f64 = 10.0;
const SHORT_SECS: f64 = 2.5;
/// Folder of the excerpts in the work folder during the measurement.
pub(super) const FOLDER: &str = "timing";

/// A segment of a unit's video.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedExcerpt {
    pub unit: usize,
    pub start_secs: f64,
    pub secs: f64,
}

/// Excerpts of videos of these lengths (seconds): a tenth of the total, evenly spread, and two short ones.
pub fn excerpts(lengths: &[f64]) -> Vec<TimedExcerpt> {
    let total_secs: f64 = lengths.iter().sum();
    let budget = (SHARE * total_secs).clamp(MIN_SECS, MAX_SECS).min(total_secs);
    let n = (((budget - 2.0 * SHORT_SECS) / LONG_SECS).floor() as usize).max(1);
    let at = |share: f64, secs: f64| {
        let mut left = share * total_secs;
        for (unit, length) in lengths.iter().enumerate() {
            if left < *length {
                let secs = secs.min(*length);
                return Some(TimedExcerpt { unit, start_secs: (left - secs / 2.0).clamp(0.0, length - secs), secs });
            }
            left -= length;
        }
        None
    };
    let long = (0..n).map(|k| at((k as f64 + 0.5) / n as f64, LONG_SECS));
    long.chain([1.0 / 3.0, 2.0 / 3.0].map(|share| at(share, SHORT_SECS))).flatten().collect()
}

/// Hash of everything that the times depend on: program, settings, models, machine and number of jobs.
pub fn fingerprint(pipeline: &Pipeline, program: &Path, jobs: usize) -> Result<String> {
    let inputs = (
        hash_file(program)?,
        settings_hash(pipeline.config())?,
        pipeline.model_hashes()?,
        processor(),
        std::thread::available_parallelism().map_or(1, |n| n.get()),
        jobs,
    );
    Ok(blake3::hash(&serde_json::to_vec(&inputs)?).to_hex().to_string())
}

/// Times the stages on excerpts of units of known length, `jobs` in parallel. Excerpts and artifacts are then removed.
///
/// # Errors
/// No excerpt could be copied or processed, or the work folder cannot be written.
pub fn measure(
    pipeline: &Pipeline,
    program: &Path,
    units: &[PlannedUnit],
    jobs: usize,
    progress: &dyn Progress,
) -> Result<StageTimes> {
    let fingerprint = fingerprint(pipeline, program, jobs)?;
    let folder = pipeline.config().settings.work.dir.join(FOLDER);
    let timed = time_excerpts(pipeline, units, jobs, &folder, progress);
    let removed = std::fs::remove_dir_all(&folder);
    let times = timed?;
    removed.with_context(|| format!("cannot remove {}", folder.display()))?;
    Ok(StageTimes { fingerprint, processor: processor(), jobs, ..times })
}

fn time_excerpts(
    pipeline: &Pipeline,
    units: &[PlannedUnit],
    jobs: usize,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<StageTimes> {
    let _ = std::fs::remove_dir_all(folder);
    std::fs::create_dir_all(folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    let lengths: Vec<f64> = units.iter().map(|unit| unit.secs.unwrap_or(0.0)).collect();
    let (mut files, mut secs) = (Vec::new(), BTreeMap::new());
    for (number, excerpt) in excerpts(&lengths).iter().enumerate() {
        let unit = &units[excerpt.unit];
        let to = folder.join(format!("{number:02}.mkv"));
        let excerpt = ExcerptRequest { start_secs: excerpt.start_secs, secs: excerpt.secs, to: to.clone() };
        let request = MediaRequest { source: unit.source.clone(), excerpt: Some(excerpt) };
        // An unreadable video is reported when it is processed.
        if let Ok(Some(copied)) = pipeline.ask_media(&request) {
            secs.insert(to.clone(), copied);
            files.push((unit.speaker.clone(), to));
        }
    }
    ensure!(
        !files.is_empty(),
        "cannot time the stages: no excerpt could be copied from any video; use --no-timing to plan without estimates"
    );
    let work = folder.join("work");
    let task = progress.begin("timing the stages", 1);
    let selection = Selection { to: StageName::Dataset, jobs: Some(jobs), force: true, ..Selection::default() };
    let times = pipeline.on_excerpts(&files, &work).run(&selection, &Silent)?.times;
    task.advance(1);
    let peak_mib = peak_mib();
    let excerpt_secs: f64 = secs.values().sum();
    let transcribes = pipeline.config().settings.transcribes_any();
    let is_timed = |stage: &StageName| transcribes || *stage != StageName::Transcribe;
    let cost = |stage: StageName| {
        let own = times.iter().filter(|time| time.stage == stage);
        let length = |time: &StageTime| match stage {
            StageName::Dataset => excerpt_secs,
            _ => secs.get(&time.unit.source).copied().unwrap_or(0.0),
        };
        let pairs: Vec<(f64, f64)> = own.map(|time| (length(time), time.secs)).collect();
        let bytes_per_sec = workdir::bytes_under(&work.join(stage.as_str())) as f64 / excerpt_secs;
        (stage.as_str().to_owned(), StageCost { bytes_per_sec, ..StageCost::fit(&pairs) })
    };
    Ok(StageTimes {
        n_excerpts: files.len(),
        excerpt_secs,
        stages: StageName::ALL.into_iter().filter(is_timed).map(cost).collect(),
        peak_mib,
        ..StageTimes::default()
    })
}

/// Peak memory of the child processes that have exited, MiB; `None` if there were none.
fn peak_mib() -> Option<f64> {
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN).ok()?;
    Some(usage.max_rss() as f64 / 1024.0).filter(|peak| *peak > 0.0)
}

/// Name of the processor, if the system reports it.
fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| "unknown".to_owned(), |(_, name)| name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excerpts_cover_a_tenth_evenly_within_the_videos() {
        let lengths = [600.0, 2.0, 300.0, 298.0];
        let some = excerpts(&lengths);
        assert!(some.iter().map(|one| one.secs).sum::<f64>() <= 0.1 * lengths.iter().sum::<f64>());
        assert_eq!(some.len(), 13);
        assert!(some.iter().all(|one| one.start_secs >= 0.0 && one.start_secs + one.secs <= lengths[one.unit] + 1e-9));
        let of = |unit: usize| some.iter().filter(|one| one.unit == unit && one.secs > SHORT_SECS).count();
        assert_eq!((of(0), of(2), of(3)), (5, 2, 3));
        // For short videos, at least half a minute is timed.
        let few = excerpts(&[60.0]);
        assert_eq!((few.len(), few[0].secs), (4, LONG_SECS));
        assert_eq!(excerpts(&[1.5]), [TimedExcerpt { unit: 0, start_secs: 0.0, secs: 1.5 }; 3]);
        assert!(excerpts(&[]).is_empty());
    }
}
