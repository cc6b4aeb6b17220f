//! First sections: totals, seconds by reason, and a table of videos.

use super::reasons;
use super::reasons::WAITING;
use super::video::VideoSummary;
use crate::html;
use crate::html::chart::bars::{StackedBar, bars};
use crate::html::numbers::{length, percent};
use crate::html::{Node, legend, node};
use crate::splits::VideoSplits;
use orator_base::stage::counted;
use std::collections::BTreeMap;

/// Seconds of all videos together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportTotals {
    pub whole: f64,
    pub kept: f64,
    pub failed: f64,
    pub waiting: f64,
    pub refused: BTreeMap<String, f64>,
    pub n_kept: usize,
}

impl ReportTotals {
    pub fn sum(videos: &[VideoSummary]) -> Self {
        let mut sums = Self::default();
        for ledger in videos.iter().map(|video| &video.ledger) {
            sums.whole += ledger.duration_secs;
            sums.kept += ledger.kept_secs();
            sums.n_kept += ledger.kept.len();
            for failed in &ledger.failed {
                let sum = if failed.stage == WAITING { &mut sums.waiting } else { &mut sums.failed };
                *sum += failed.end_secs - failed.start_secs;
            }
            for (reason, secs) in ledger.refused_secs() {
                *sums.refused.entry(reason).or_default() += secs;
            }
        }
        sums
    }

    pub fn refused_secs(&self) -> f64 {
        self.refused.values().sum()
    }
}

/// Totals as tiles, with notes.
pub fn totals(sums: &ReportTotals, videos: &[VideoSummary], missing: &[String]) -> Vec<Node> {
    let tile = |name: &str, id: &str, secs: f64, description: String| {
        let value = node("b").id(id).attr("data-secs", format!("{secs:.3}")).text(length(secs));
        node("div").class("tile").text(name).child(value).child(node("small").text(description))
    };
    let share = |secs: f64| percent(secs, sums.whole);
    let n_failed = videos.iter().filter(|video| video.has_failed).count();
    let mut tiles = vec![
        tile("Kept", "kept-secs", sums.kept, format!("{} in {}", share(sums.kept), counted(sums.n_kept, "interval"))),
        tile("Refused", "refused-secs", sums.refused_secs(), share(sums.refused_secs())),
        tile("Failed", "failed-secs", sums.failed, counted(n_failed, "video")),
        tile("All", "all-secs", sums.whole, counted(videos.len(), "video")),
    ];
    if sums.waiting > 0.0 {
        tiles.insert(3, tile("Not done yet", "waiting-secs", sums.waiting, share(sums.waiting)));
    }
    let speakers = by_speaker(videos);
    let notes = missing.iter().map(|text| node("p").class("note").text(text));
    std::iter::once(node("div").class("tiles").children(tiles)).chain(speakers).chain(notes).collect()
}

/// What told speech from other sound.
pub fn speech((n_heard, n_videos): (usize, usize)) -> Node {
    let text = match n_heard {
        0 => "Speech was told by loudness alone; min_speech changes nothing.".to_owned(),
        n if n == n_videos => "Speech was told by the speech model beside loudness.".to_owned(),
        n => {
            format!("Speech was told by the speech model in {n} of {n_videos} videos, by loudness alone in the others.")
        }
    };
    node("p").class("note").text(text)
}

/// Bar for each reason, the longest first.
pub fn by_reason(sums: &ReportTotals) -> Vec<Node> {
    let bar = |name: &str, class: &str, secs: f64, description: &'static str| StackedBar {
        name: name.to_owned(),
        class: class.to_owned(),
        secs,
        description,
    };
    let of_reason =
        |(reason, secs): (&String, &f64)| bar(reason, &reasons::class(reason), *secs, reasons::heading(reason));
    let mut parts: Vec<StackedBar> = sums.refused.iter().map(of_reason).collect();
    parts.sort_by(|a, b| b.secs.total_cmp(&a.secs).then(a.name.cmp(&b.name)));
    parts.insert(0, bar("kept", "kept", sums.kept, "worth learning from"));
    if sums.failed > 0.0 {
        parts.push(bar("failed", "failed", sums.failed, "a stage failed"));
    }
    if sums.waiting > 0.0 {
        parts.push(bar(WAITING, "waiting", sums.waiting, "no verdict yet"));
    }
    vec![bars("Seconds kept, refused by reason, and failed", &parts, sums.whole)]
}

/// Table of the speakers, where there are several.
fn by_speaker(videos: &[VideoSummary]) -> Option<Node> {
    let mut of_speakers: BTreeMap<&str, Vec<VideoSummary>> = BTreeMap::new();
    for video in videos {
        of_speakers.entry(&video.unit.speaker).or_default().push(video.clone());
    }
    let row = |(speaker, videos): (&&str, &Vec<VideoSummary>)| {
        let sums = ReportTotals::sum(videos);
        node("tr")
            .child(node("th").attr("scope", "row").class("name").text(speaker))
            .child(node("td").class("num").text(counted(videos.len(), "video")))
            .children([sums.whole, sums.kept].map(|secs| node("td").class("num").text(length(secs))))
            .child(node("td").class("num").text(percent(sums.kept, sums.whole)))
    };
    let heads = [("Speaker", ""), ("", "num"), ("Length", "num"), ("Kept", "num"), ("", "num")];
    (of_speakers.len() > 1).then(|| html::table("speakers", heads.map(head), of_speakers.iter().map(row)))
}

fn head((name, class): (&str, &str)) -> Node {
    node("th").class(class).attr("scope", "col").text(name)
}

/// Table of videos, linked to their timelines. `splits` are the splits of each, where a dataset has it.
pub fn table(videos: &[VideoSummary], splits: &VideoSplits) -> Vec<Node> {
    let heads =
        [("Video", ""), ("Length", "num"), ("Kept", "num"), ("", "num"), ("Split", ""), ("Most refused for", "")];
    let row = |video: &VideoSummary| {
        let link = node("a").attr("href", format!("#{}", video.anchor())).text(&video.file);
        let ledger = &video.ledger;
        let mut refused: Vec<(String, f64)> = ledger.refused_secs().into_iter().collect();
        refused.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let longest = refused.iter().take(3);
        let why = legend(longest.map(|(reason, secs)| (reasons::class(reason), format!("{reason} {}", length(*secs)))));
        let state = match ledger.failed.first() {
            Some(failed) if failed.stage == WAITING => node("span").text("not done yet"),
            Some(failed) => node("span").text(format!("failed at {}", failed.stage)),
            None if ledger.duration_secs == 0.0 => {
                node("span").text(if video.has_failed { "failed" } else { "not done yet" })
            }
            None => why,
        };
        node("tr")
            .child(node("th").attr("scope", "row").class("name").child(link))
            .child(node("td").class("num").text(length(ledger.duration_secs)))
            .child(node("td").class("num").text(length(ledger.kept_secs())))
            .child(node("td").class("num").text(percent(ledger.kept_secs(), ledger.duration_secs)))
            .child(node("td").text(splits.get(&video.unit.to_string()).map_or("", String::as_str)))
            .child(node("td").child(state))
    };
    let around = node("div").class("scroll").attr("tabindex", "0").attr("role", "region").attr("aria-label", "Videos");
    vec![around.child(html::table("videos", heads.map(head), videos.iter().map(row)))]
}
