//! Report page on the videos of speakers, with its section of pictures of the worst frames.

use super::distributions::distributions;
use super::gather::{ReportData, VideoSummary, gather};
use super::summary::{self, ReportTotals};
use super::worst::{self, Moment, MomentThumbnail, Worst};
use super::{gestures, movement, sliders, timelines};
use crate::html::{Node, Page, Section, jpeg, node};
use crate::preview;
use orator_base::stage::progress::Progress;
use orator_base::stage::rejection::Rejection;
use orator_base::text::{clock, counted};
use orator_dataset::config::Settings;
use orator_dataset::config::videos::Videos;
use serde_json::json;
use std::collections::BTreeMap;

pub struct ReportRequest<'a> {
    pub settings: &'a Settings,
    pub videos: &'a [Videos],
    /// Maximum number of pictures per rule; 0: no video is opened.
    pub n_pictures: usize,
}

pub struct ReportPage {
    pub html: String,
    pub sums: ReportTotals,
    pub facts: serde_json::Value,
}

/// Creates the report. Missing data is noted on the page and is not an error.
pub fn make(request: &ReportRequest, progress: &dyn Progress) -> ReportPage {
    let ReportRequest { settings, videos, n_pictures } = *request;
    let mut gathered = gather(settings, videos, n_pictures, progress);
    let pictures = draw(settings, &mut gathered, progress);
    let sums = ReportTotals::sum(&gathered.videos);
    let facts = json!({
        "n_videos": gathered.videos.len(),
        "n_intervals": gathered.videos.iter().map(|v| v.ledger.accepted.len() + v.ledger.rejected.len() + v.ledger.failed.len()).sum::<usize>(),
        "n_pictures": pictures.len(),
        "duration_secs": sums.total,
        "accepted_secs": sums.accepted,
        "rejected_secs": sums.rejected,
        "failed_secs": sums.failed,
        "waiting_secs": sums.waiting,
        "missing": gathered.missing,
    });
    ReportPage { html: page(request, &gathered, &pictures, &sums).html(), sums, facts }
}

fn draw(settings: &Settings, gathered: &mut ReportData, progress: &dyn Progress) -> Pictures {
    let mut found = Pictures::new();
    let request: Vec<usize> =
        (0..gathered.videos.len()).filter(|video| !gathered.worst.frames_of(*video).is_empty()).collect();
    let task = progress.begin("pictures", request.len() as u64);
    for number in request {
        let video = &mut gathered.videos[number];
        task.detail(&video.unit.video);
        match worst::thumbnails(&settings.work.dir, &video.unit, number, &gathered.worst) {
            Ok(pictures) => found.extend(pictures.into_iter().map(|(frames, picture)| ((number, frames), picture))),
            Err(error) => video.note(&format!("No pictures available: {error:#}")),
        }
        task.advance(1);
    }
    found
}

fn page(request: &ReportRequest, gathered: &ReportData, pictures: &Pictures, sums: &ReportTotals) -> Page {
    let rules = &request.settings.segment;
    let per_sec = request.settings.extract.rate().per_sec();
    let ReportData { videos, accepted, measures, movement, hands, worst, previews, missing, n_speech_model } = gathered;
    let splits = summary::video_splits(request.settings, request.videos);
    let mut data = sliders::data(accepted, videos, rules);
    data["previews"] = preview::data(previews);
    let names: Vec<&str> = request.videos.iter().map(|videos| videos.speaker.as_str()).collect();
    let section = |id, title, body| Section { id, title, body };
    let mut reasons = summary::by_reason(sums);
    if n_speech_model.1 > 0 {
        reasons.push(summary::speech(*n_speech_model));
    }
    let persons = preview::faces(request.settings, request.videos);
    let persons = (!persons.is_empty()).then(|| section("persons", "Persons", persons));
    let mut page = Page {
        title: format!("Report on {}", names.join(", ")),
        lead: format!(
            "Use of each second of {}: accepted for the dataset, rejected with a reason, or missing because a stage \
             failed.",
            counted(videos.len(), "video")
        ),
        sections: vec![
            section("totals", "Totals", summary::totals(sums, videos, missing)),
            section("reasons", "Seconds by reason", reasons),
            section("videos", "Videos", summary::table(videos, &splits)),
            section("previews", "Accepted motion", preview::section(previews)),
            section("timelines", "Timelines", timelines::lines(videos)),
            section("thresholds", "Thresholds", sliders::sliders(accepted, rules)),
            section("frames", "Worst frames", gallery(worst, pictures, videos)),
            section("distributions", "Distributions", distributions(measures, request.settings, per_sec)),
            section("motion", "Motion", movement::motion(movement)),
            section("gestures", "Gestures", gestures::gestures(hands)),
        ],
        style: include_str!("page.css"),
        script: include_str!("page.js"),
        data,
    };
    if let Some(persons) = persons {
        page.sections.insert(3, persons);
    }
    page
}

pub type Pictures = BTreeMap<(usize, Vec<usize>), MomentThumbnail>;

pub fn gallery(worst: &Worst, pictures: &Pictures, videos: &[VideoSummary]) -> Vec<Node> {
    if worst.rules.is_empty() {
        return vec![
            node("p").class("empty").text("No rejected intervals, or pictures were disabled with `--pictures 0`."),
        ];
    }
    let about = "For each rule, the rejected intervals that violate it most, each at its worst frame with the detected \
                 keypoints. Two pictures side by side are consecutive frames.";
    let mut shown = vec![node("p").text(about)];
    for ((_, reason, unit), moments) in &worst.rules {
        let swatch = node("span").class(format!("swatch {}", timelines::class(reason)));
        let measured = if unit.is_empty() { String::new() } else { format!(", threshold in {unit}") };
        let about = format!("{}{measured}", counted(moments.len(), "interval"));
        let title = node("h3")
            .class("rule")
            .child(swatch)
            .child(node("span").text(Rejection::label(reason)))
            .child(node("small").text(about));
        let cards = moments.iter().filter_map(|moment| Some(card(moment, videos.get(moment.video)?, pictures)));
        shown.push(node("div").class("gallery").child(title).child(node("div").class("shots").children(cards)));
    }
    shown
}

fn card(moment: &Moment, video: &VideoSummary, pictures: &Pictures) -> Node {
    let at = format!("{} at {}", video.file, clock(moment.secs));
    let shown = match pictures.get(&(moment.video, moment.frames.clone())) {
        Some(found) => jpeg(&found.jpeg, found.size, &format!("{at}: {}", moment.description)),
        None => node("p").class("empty nopicture").text("Picture not available."),
    };
    let link = node("a").attr("href", format!("#{}", video.anchor())).text(at);
    let description = if moment.frame_value.is_empty() {
        moment.description.clone()
    } else {
        format!("{}; {}", moment.description, moment.frame_value)
    };
    node("figure")
        .class(if moment.frames.len() > 1 { "card shot pair" } else { "card shot" })
        .child(shown)
        .child(node("figcaption").child(link).child(node("small").text(description)))
}
