//! Report page on the videos of speakers.

use super::distributions::distributions;
use super::gallery::{Pictures, gallery};
use super::gather::{ReportData, gather};
use super::summary;
use super::summary::ReportTotals;
use super::{motion, pictures, sliders, timelines};
use crate::faces;
use crate::html::{Page, Section};
use crate::preview;
use orator_base::stage::progress::Progress;
use orator_base::text::counted;
use orator_dataset::config::Settings;
use orator_dataset::config::videos::Videos;
use serde_json::json;

/// Request for a report.
pub struct ReportRequest<'a> {
    pub settings: &'a Settings,
    pub videos: &'a [Videos],
    /// Maximum number of pictures per rule; 0: no video is opened.
    pub n_pictures: usize,
}

/// Report as a page and as data.
pub struct ReportPage {
    pub html: String,
    pub sums: ReportTotals,
    /// Totals as JSON.
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
        match pictures::thumbnails(&settings.work.dir, &video.unit, number, &gathered.worst) {
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
    let ReportData { videos, accepted, measures, movement, worst, previews, missing, n_speech_model } = gathered;
    let splits = summary::video_splits(request.settings, request.videos);
    let mut data = sliders::data(accepted, videos, rules);
    data["previews"] = preview::data(previews);
    let names: Vec<&str> = request.videos.iter().map(|videos| videos.speaker.as_str()).collect();
    let section = |id, title, body| Section { id, title, body };
    let mut reasons = summary::by_reason(sums);
    if n_speech_model.1 > 0 {
        reasons.push(summary::speech(*n_speech_model));
    }
    let persons = faces::section(request.settings, request.videos);
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
            section("motion", "Motion", motion::motion(movement)),
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
