//! Report section with a slider for each threshold (`page.js` makes it interactive), and its precomputed results: the
//! rules of `segment` are applied again to the stored measures, and those of `lift` to the stored bone changes, with
//! one threshold at each value of its grid and the others as configured. Frames that lifting left open stay rejected;
//! frames that were never lifted count as good.

use super::gather::VideoSummary;
use super::thresholds::{THRESHOLDS, ThresholdGrid};
use crate::html::chart::lines::curve;
use crate::html::{Node, node};
use orator_base::stage::ledger::Ledger;
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::text::{length, with_unit};
use orator_dataset::config::SegmentConfig;
use orator_dataset::decisions::Decision;
use orator_formats::media_json::MediaInfo;
use orator_pipeline::lift::reject::{bone_rejections, exclude_frames, max_gap_frames};
use orator_pipeline::segment::{self, Measures};
use rayon::prelude::*;
use serde_json::{Value, json};

fn sums(accepted: &[Option<AcceptedByThreshold>], rules: &SegmentConfig) -> AcceptedByThreshold {
    let zeros =
        || THRESHOLDS.iter().map(|threshold| vec![0.0; threshold.grid(rules).0.len()]).collect::<AcceptedByThreshold>();
    accepted.iter().flatten().fold(zeros(), |mut sums, of| {
        for (sums, of) in sums.iter_mut().zip(of) {
            sums.iter_mut().zip(of).for_each(|(sum, secs)| *sum += secs);
        }
        sums
    })
}

/// Data for the script: thresholds with their values and total seconds, and videos with their accepted tenths of a
/// second by threshold and value.
pub fn data(accepted: &[Option<AcceptedByThreshold>], videos: &[VideoSummary], rules: &SegmentConfig) -> Value {
    let milli = |secs: f64| (secs * 1000.0).round() / 1000.0;
    let row = |(threshold, sums): (&ThresholdGrid, &Vec<f64>)| {
        let (grid, now) = threshold.grid(rules);
        json!({
            "key": threshold.key,
            "unit": threshold.unit,
            "now": now,
            "values": grid.iter().map(|value| threshold.written(*value)).collect::<Vec<_>>(),
            "secs": sums.iter().map(|secs| milli(*secs)).collect::<Vec<_>>(),
        })
    };
    let thresholds: Vec<Value> = THRESHOLDS.iter().zip(&sums(accepted, rules)).map(row).collect();
    let tenths = |row: &Vec<f64>| row.iter().map(|secs| (secs * 10.0).round() as u64).collect::<Vec<_>>();
    let judged = videos.iter().zip(accepted).filter_map(|(video, accepted)| {
        let rows = accepted.as_ref()?.iter().map(tenths).collect::<Vec<_>>();
        Some(json!({ "name": video.file, "id": video.anchor(), "tenths": rows }))
    });
    json!({ "thresholds": thresholds, "videos": judged.collect::<Vec<_>>() })
}

pub fn sliders(accepted: &[Option<AcceptedByThreshold>], rules: &SegmentConfig) -> Vec<Node> {
    if accepted.iter().all(Option::is_none) {
        return vec![node("p").class("empty").text("No video has been processed yet: run `orator run`.")];
    }
    let about = "Each slider changes one threshold and leaves the others at their configured values. The durations are \
                 exact: at each step the rules were applied again to the stored measurements of all videos. Frames \
                 that lifting rejected (bone length, missing joints) stay rejected, and frames that were never lifted \
                 count as accepted. max_bone_change has no slider.";
    let sums = sums(accepted, rules);
    let max = sums.iter().flatten().copied().fold(0.0, f64::max);
    let cards =
        THRESHOLDS.iter().zip(&sums).enumerate().map(|(i, (threshold, sums))| card(i, threshold, sums, max, rules));
    let now = sums.first().map_or(0.0, |row| row[THRESHOLDS[0].grid(rules).1]);
    let toml = node("pre").child(node("code").id("toml").text("# as configured"));
    let result = node("div")
        .class("result")
        .attr("role", "status")
        .child(
            node("p")
                .child(node("b").id("now").attr("data-secs", format!("{now:.3}")).text(length(now)))
                .text(" accepted, ")
                .child(node("span").id("change").text("as configured")),
        )
        .child(
            node("div").class("toml").child(toml).child(node("button").attr("type", "button").id("copy").text("Copy")),
        )
        .child(
            node("details")
                .child(node("summary").text("By video"))
                .child(node("div").class("scroll").child(node("table").id("by-video").child(node("tbody")))),
        );
    vec![
        node("p").text(about),
        node("div").class("sliding").child(node("div").class("grid knobs").children(cards)).child(result),
    ]
}

fn card(i: usize, threshold: &ThresholdGrid, sums: &[f64], max: f64, rules: &SegmentConfig) -> Node {
    let (grid, now) = threshold.grid(rules);
    let id = format!("slider-{}", threshold.key);
    let label = node("label").attr("for", &id).child(node("code").text(threshold.key));
    let configured = with_unit(grid[now], threshold.unit);
    let slider = node("input")
        .attr("type", "range")
        .id(&id)
        .attr("data-threshold", i)
        .attr("min", 0)
        .attr("max", grid.len() - 1)
        .attr("step", 1)
        .attr("value", now)
        .attr("autocomplete", "off")
        .attr("aria-valuetext", &configured);
    let description = format!("{}: accepted seconds by threshold value", threshold.key);
    let values = node("p")
        .class("values")
        .child(node("output").class("value").attr("for", &id).text(&configured))
        .child(node("output").class("secs").attr("for", &id).text(length(sums[now])));
    node("div")
        .class("card knob")
        .child(node("h3").child(label))
        .child(node("small").text(threshold.description))
        .child(curve(&description, sums, max, now))
        .child(slider)
        .child(values)
}

/// Accepted seconds of one video, by threshold and by value of its grid.
pub type AcceptedByThreshold = Vec<Vec<f64>>;

pub struct JudgedVideo<'a> {
    pub measures: &'a Measures,
    pub video: &'a MediaInfo,
    /// Relative change of bone length in each frame, measured by the lift stage; empty if the video is not lifted.
    pub bone_change: &'a [f32],
    /// Largest accepted relative change of a bone's length.
    pub max_bone_change: f64,
    /// Refusals of the frames that the lift stage left open; empty if the video is not lifted.
    pub open: &'a [Option<FrameRejection>],
    /// Decisions of users on the video.
    pub decisions: &'a [&'a Decision],
}

impl JudgedVideo<'_> {
    pub fn ledger(&self, rules: &SegmentConfig) -> Ledger {
        let (mut intervals, mut ledger) = segment::judge(self.measures, self.video, rules, self.decisions);
        let bones = bone_rejections(self.bone_change, self.max_bone_change, max_gap_frames(rules, self.video.fps));
        for rejections in [&bones[..], self.open] {
            if rejections.len() == intervals.n_frames
                && let Ok(left) = exclude_frames(&intervals, &ledger, rejections, rules.min_frames)
            {
                (intervals, ledger) = left;
            }
        }
        ledger
    }

    pub fn accepted_secs(&self, rules: &SegmentConfig) -> f64 {
        self.ledger(rules).accepted_secs()
    }

    /// Accepted seconds at every value of every threshold, computed on all cores.
    pub fn table(&self, rules: &SegmentConfig) -> AcceptedByThreshold {
        let row = |threshold: &super::thresholds::ThresholdGrid| -> Vec<f64> {
            let (grid, _) = threshold.grid(rules);
            grid.into_par_iter().map(|value| self.accepted_secs(&threshold.with(rules, value))).collect()
        };
        THRESHOLDS.par_iter().map(row).collect()
    }
}

/// Rejection of each frame that the ledger of a lifted video lists as left open.
pub fn open_frames(ledger: &Ledger, video: &MediaInfo) -> Vec<Option<FrameRejection>> {
    let mut open = vec![None; video.n_frames];
    let is_open = |reason: &str, unit: &str| Rejection::find(reason, unit) == Some(Rejection::MissingJoints);
    for span in ledger.rejected.iter().filter(|span| is_open(&span.reason, &span.unit)) {
        let frame = |secs: f64| ((secs * video.fps.per_sec()).round() as usize).min(video.n_frames);
        // The video may end within the last frame.
        let end = if span.end_secs == video.duration_secs { video.n_frames } else { frame(span.end_secs) };
        let why = FrameRejection::new(Rejection::MissingJoints, span.measured, span.threshold);
        open[frame(span.start_secs).min(end)..end].fill(Some(why));
    }
    open
}
