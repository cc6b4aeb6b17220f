//! First sections of the report: totals, seconds by reason, and a table of videos.

use super::gather::VideoSummary;
use super::timelines::{self, WAITING};
use crate::html::{self, Node, legend, node};
use orator_base::stage::artifacts::{StageName, dir, speaker_dir};
use orator_base::stage::record::Record;
use orator_base::stage::rejection::Rejection;
use orator_base::text::{counted, length, percent};
use orator_base::types::split::Split;
use orator_dataset::INFO;
use orator_dataset::config::Settings;
use orator_dataset::config::videos::Videos;
use orator_dataset::info::{DatasetInfo, DatasetVideo};
use std::collections::BTreeMap;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportTotals {
    /// All footage.
    pub total: f64,
    pub accepted: f64,
    pub failed: f64,
    /// Not processed yet.
    pub waiting: f64,
    /// By reason.
    pub rejected: BTreeMap<String, f64>,
    pub n_accepted: usize,
}

impl ReportTotals {
    pub fn sum(videos: &[VideoSummary]) -> Self {
        let mut sums = Self::default();
        for ledger in videos.iter().map(|video| &video.ledger) {
            sums.total += ledger.duration_secs;
            sums.accepted += ledger.accepted_secs();
            sums.n_accepted += ledger.accepted.len();
            for failed in &ledger.failed {
                let sum = if failed.stage == WAITING { &mut sums.waiting } else { &mut sums.failed };
                *sum += failed.end_secs - failed.start_secs;
            }
            for (reason, secs) in ledger.rejected_secs() {
                *sums.rejected.entry(reason).or_default() += secs;
            }
        }
        sums
    }

    pub fn rejected_secs(&self) -> f64 {
        self.rejected.values().sum()
    }
}

/// Section of totals: tiles, a table of speakers, and notes.
pub fn totals(sums: &ReportTotals, videos: &[VideoSummary], missing: &[String]) -> Vec<Node> {
    let tile = |name: &str, id: &str, secs: f64, description: String| {
        let value = node("b").id(id).attr("data-secs", format!("{secs:.3}")).text(length(secs));
        node("div").class("tile").text(name).child(value).child(node("small").text(description))
    };
    let share = |secs: f64| percent(secs, sums.total);
    let n_failed = videos.iter().filter(|video| video.has_failed).count();
    let mut tiles = vec![
        tile(
            "Accepted",
            "accepted-secs",
            sums.accepted,
            format!("{} in {}", share(sums.accepted), counted(sums.n_accepted, "interval")),
        ),
        tile("Rejected", "rejected-secs", sums.rejected_secs(), share(sums.rejected_secs())),
        tile("Failed", "failed-secs", sums.failed, counted(n_failed, "video")),
        tile("Total", "total-secs", sums.total, counted(videos.len(), "video")),
    ];
    if sums.waiting > 0.0 {
        tiles.insert(3, tile("Not processed", "waiting-secs", sums.waiting, share(sums.waiting)));
    }
    let speakers = by_speaker(videos);
    let notes = missing.iter().map(|text| node("p").class("note").text(text));
    std::iter::once(node("div").class("tiles").children(tiles)).chain(speakers).chain(notes).collect()
}

/// Note on how speech was detected.
pub fn speech((n_speech_model, n_videos): (usize, usize)) -> Node {
    let text = match n_speech_model {
        0 => "Speech was detected by loudness only; min_speech has no effect.".to_owned(),
        n if n == n_videos => "Speech was detected by the speech model and by loudness.".to_owned(),
        n => {
            format!(
                "Speech was detected by the speech model in {n} of {n_videos} videos, by loudness only in the others."
            )
        }
    };
    node("p").class("note").text(text)
}

/// Part of all footage: name, CSS class of its colour, seconds, and its description, which may be empty.
type Part<'a> = (&'a str, String, f64, &'static str);

/// Section with a bar for each reason, the longest first.
pub fn by_reason(sums: &ReportTotals) -> Vec<Node> {
    let of_reason = |(reason, secs): (&'_ String, &f64)| {
        (reason.clone(), timelines::class(reason), *secs, timelines::heading(reason))
    };
    let mut rejected: Vec<_> = sums.rejected.iter().map(of_reason).collect();
    rejected.sort_by(|a, b| b.2.total_cmp(&a.2).then(a.0.cmp(&b.0)));
    let mut parts: Vec<Part> = vec![("accepted", "accepted".to_owned(), sums.accepted, "usable for the dataset")];
    parts.extend(
        rejected.iter().map(|(name, class, secs, heading)| (Rejection::label(name), class.clone(), *secs, *heading)),
    );
    if sums.failed > 0.0 {
        parts.push(("failed", "failed".to_owned(), sums.failed, "a stage failed"));
    }
    if sums.waiting > 0.0 {
        parts.push((WAITING, "waiting".to_owned(), sums.waiting, "no stage has finished"));
    }
    let longest = parts.iter().map(|part| part.2).fold(0.0, f64::max).max(1e-9);
    let caption = node("caption").class("visually-hidden").text("Accepted, rejected (by reason) and failed seconds");
    let rows = parts.iter().map(|part| bar(part, longest, sums.total));
    vec![node("table").class("bars").child(caption).child(node("tbody").children(rows))]
}

/// Table row of a part; the bar is relative to `longest`, the percentage to `total`.
fn bar((name, class, secs, description): &Part, longest: f64, total: f64) -> Node {
    let style = format!("width:{:.2}%", 100.0 * secs / longest);
    let name = node("th").attr("scope", "row").text(name);
    let name = if description.is_empty() { name } else { name.child(node("small").text(description)) };
    let drawn = node("div").class(format!("bar {class}")).attr("style", style);
    let cells = [length(*secs), percent(*secs, total)].map(|text| node("td").class("num").text(text));
    node("tr").child(name).child(node("td").class("barcell").child(drawn)).children(cells)
}

/// Table of speakers; `None` if there is only one.
fn by_speaker(videos: &[VideoSummary]) -> Option<Node> {
    let mut of_speakers: BTreeMap<&str, Vec<VideoSummary>> = BTreeMap::new();
    for video in videos {
        of_speakers.entry(&video.unit.speaker).or_default().push(video.clone());
    }
    let row = |(speaker, videos): (&&str, &Vec<VideoSummary>)| {
        let sums = ReportTotals::sum(videos);
        node("tr")
            .child(node("th").attr("scope", "row").class("name").text(speaker))
            .child(node("td").class("num").text(videos.len()))
            .children([sums.total, sums.accepted].map(|secs| node("td").class("num").text(length(secs))))
            .child(node("td").class("num").text(percent(sums.accepted, sums.total)))
    };
    let heads = [("Speaker", ""), ("Videos", "num"), ("Length", "num"), ("Accepted", "num"), ("Share", "num")];
    (of_speakers.len() > 1).then(|| html::table("speakers", heads.map(head), of_speakers.iter().map(row)))
}

fn head((name, class): (&str, &str)) -> Node {
    node("th").class(class).attr("scope", "col").text(name)
}

/// Table of videos, linked to their timelines. `splits` names the splits of videos that are in a dataset.
pub fn table(videos: &[VideoSummary], splits: &VideoSplits) -> Vec<Node> {
    let heads = [
        ("Video", ""),
        ("Length", "num"),
        ("Accepted", "num"),
        ("Share", "num"),
        ("Split", ""),
        ("Main reasons for rejection", ""),
    ];
    let row = |video: &VideoSummary| {
        let link = node("a").attr("href", format!("#{}", video.anchor())).text(&video.file);
        let ledger = &video.ledger;
        let mut rejected: Vec<(String, f64)> = ledger.rejected_secs().into_iter().collect();
        rejected.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let longest = rejected.iter().take(3);
        let why = legend(longest.map(|(reason, secs)| {
            (timelines::class(reason), format!("{} {}", Rejection::label(reason), length(*secs)))
        }));
        let state = match ledger.failed.first() {
            Some(failed) if failed.stage == WAITING => node("span").text("not processed"),
            Some(failed) => node("span").text(format!("failed at {}", failed.stage)),
            None if ledger.duration_secs == 0.0 => {
                node("span").text(if video.has_failed { "failed" } else { "not processed" })
            }
            None => why,
        };
        node("tr")
            .child(node("th").attr("scope", "row").class("name").child(link))
            .child(node("td").class("num").text(length(ledger.duration_secs)))
            .child(node("td").class("num").text(length(ledger.accepted_secs())))
            .child(node("td").class("num").text(percent(ledger.accepted_secs(), ledger.duration_secs)))
            .child(node("td").text(splits.get(&video.unit.to_string()).map_or("", String::as_str)))
            .child(node("td").child(state))
    };
    let around = node("div").class("scroll").attr("tabindex", "0").attr("role", "region").attr("aria-label", "Videos");
    vec![around.child(html::table("videos", heads.map(head), videos.iter().map(row)))]
}

/// Names of the splits of each video, by `speaker/video`.
pub type VideoSplits = BTreeMap<String, String>;

/// Splits of all videos in the datasets of their speakers.
pub fn video_splits(settings: &Settings, videos: &[Videos]) -> VideoSplits {
    let mut splits = VideoSplits::new();
    for Videos { speaker, units, .. } in videos {
        // A single file is read, which is consistent even while a run replaces the dataset.
        let info = std::fs::read(speaker_dir(&settings.work.dir, StageName::Dataset, speaker).join(INFO));
        let info: Option<DatasetInfo> = info.ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
        for unit in units {
            let extracted = Record::read(&dir(&settings.work.dir, StageName::Extract, unit));
            let content = extracted.and_then(|record| record.fingerprint.inputs.get("video").cloned());
            // The dataset names videos by their content, the work folder by their path.
            let is_of = |video: &&DatasetVideo| match &content {
                Some(content) => video.content == *content,
                None => unit.source.file_name().is_some_and(|name| name == video.file.as_str()),
            };
            let split = match &info {
                None => "no dataset yet".to_owned(),
                Some(info) => info.videos.iter().find(is_of).map_or_else(String::new, split_names),
            };
            splits.insert(unit.to_string(), if split.is_empty() { "none".to_owned() } else { split });
        }
    }
    splits
}

/// Names of the splits of a video or of its time blocks; empty if it has no samples.
fn split_names(video: &DatasetVideo) -> String {
    let has =
        |split: &Split| video.split == Some(*split) || video.blocks.iter().any(|block| block.split == Some(*split));
    if video.samples == 0 {
        return String::new();
    }
    Split::ALL.into_iter().filter(has).map(Split::name).collect::<Vec<_>>().join(", ")
}
