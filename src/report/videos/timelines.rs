//! Report section with a timeline of each video: accepted seconds, and the reasons for the others. Labels,
//! descriptions, order and CSS classes of the reasons for all pages: each colour stands for a kind of reason; the
//! second reason of a kind is striped (`page.css`).

use super::gather::VideoSummary;
use crate::html::chart::timeline::{TimelineSpan, timeline};
use crate::html::{self, Node, node};
use orator_base::stage::ledger::{AcceptedInterval, RejectedInterval};
use orator_base::stage::rejection::Rejection;
use orator_base::text::{clock, counted, length, number, with_unit};
use std::collections::BTreeSet;

/// Maximum number of intervals of all timelines together, which bounds the size of the page.
const MAX_SPANS: usize = 40_000;
/// Number of intervals that each timeline may have in any case.
const MIN_SPANS: usize = 50;
/// Minimum width of a timeline relative to the longest.
const MIN_WIDTH: f64 = 0.05;

/// Section with the timelines of all videos and their legend.
pub fn lines(videos: &[VideoSummary]) -> Vec<Node> {
    let longest = videos.iter().map(|video| video.ledger.duration_secs).fold(0.0, f64::max).max(1e-9);
    let max_spans = (MAX_SPANS / videos.len().max(1)).max(MIN_SPANS);
    let wide = node("label")
        .class("wide small")
        .child(node("input").attr("type", "checkbox").id("wide"))
        .text(" show all timelines at full width");
    let mut shown = vec![
        node("p").text(
            "The timelines are as long as their videos. Hover over an interval, or use the arrow keys, to see what was \
             measured. Intervals shorter than a window (min_frames) are rejected as too short.",
        ),
        legend(videos),
        wide,
    ];
    shown.extend(videos.iter().map(|video| {
        let ledger = &video.ledger;
        let rest = match ledger.resting_secs() {
            secs if secs >= 0.05 => format!(", hands at rest for {}", length(secs)),
            _ => String::new(),
        };
        let words =
            video.words.map(|of| format!(", with {} of {} words", of.n_accepted, of.n_words)).unwrap_or_default();
        let about = format!(
            "{} of {} accepted in {}{rest}{words}",
            length(ledger.accepted_secs()),
            length(ledger.duration_secs),
            counted(ledger.accepted.len(), "interval")
        );
        let share = (ledger.duration_secs / longest).max(MIN_WIDTH);
        let title = node("h3").child(node("span").text(&video.file)).child(node("small").text(about));
        let line = if ledger.duration_secs > 0.0 {
            timeline(&format!("Timeline of {}", video.file), ledger.duration_secs, &spans(video), max_spans)
        } else {
            node("p").class("empty").text("No data for this video.")
        };
        let line = node("div").class("line").attr("style", format!("--share:{:.2}%", 100.0 * share)).child(line);
        let notes = video.notes.iter().map(|text| node("p").class("note small").text(text));
        node("article").class("video").id(video.anchor()).child(title).child(line).children(notes)
    }));
    shown
}

/// Intervals of a ledger, sorted by start.
fn spans(video: &VideoSummary) -> Vec<TimelineSpan> {
    let ledger = &video.ledger;
    let timeline_span = |start_secs: f64, end_secs: f64, class: String, word: &str, description: String| TimelineSpan {
        start_secs,
        end_secs,
        class,
        word: word.to_owned(),
        description: format!(
            "{} to {} ({} s): {word}\n{description}",
            clock(start_secs),
            clock(end_secs),
            number((10.0 * (end_secs - start_secs)).round() / 10.0)
        )
        .replace("\n\n", "\n")
        .trim_end()
        .to_owned(),
    };
    let rests = |accepted: &AcceptedInterval| {
        let inside =
            |rest: &&AcceptedInterval| accepted.start_secs <= rest.start_secs && rest.end_secs <= accepted.end_secs;
        let span =
            |rest: &AcceptedInterval| format!("hands at rest {} to {}", clock(rest.start_secs), clock(rest.end_secs));
        ledger.resting.iter().filter(inside).map(span).collect::<Vec<_>>().join("\n")
    };
    let accepted = ledger.accepted.iter().map(|accepted| {
        let description = [rests(accepted).as_str(), video.spoken(accepted.start_secs)].join("\n");
        timeline_span(accepted.start_secs, accepted.end_secs, "accepted".to_owned(), "accepted", description)
    });
    let rejected = ledger.rejected.iter().map(|rejected| {
        timeline_span(
            rejected.start_secs,
            rejected.end_secs,
            class(&rejected.reason),
            Rejection::label(&rejected.reason),
            [description(rejected).as_str(), video.spoken(rejected.start_secs)].join("\n"),
        )
    });
    let failed = ledger.failed.iter().map(|failed| {
        let (class, word) = if failed.stage == WAITING { ("waiting", WAITING) } else { ("failed", "failed") };
        let description = video.notes.first().cloned().unwrap_or_default();
        timeline_span(failed.start_secs, failed.end_secs, class.to_owned(), word, description)
    });
    let mut all: Vec<TimelineSpan> = accepted.chain(rejected).chain(failed).collect();
    all.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
    all
}

fn legend(videos: &[VideoSummary]) -> Node {
    let ledgers = || videos.iter().map(|video| &video.ledger);
    let found: BTreeSet<(usize, &str)> = ledgers()
        .flat_map(|ledger| &ledger.rejected)
        .map(|rejected| (order(&rejected.reason), rejected.reason.as_str()))
        .collect();
    let stages: BTreeSet<&str> = ledgers().flat_map(|ledger| &ledger.failed).map(|f| f.stage.as_str()).collect();
    let mut entries = vec![("accepted".to_owned(), "accepted")];
    entries.extend(found.iter().map(|(_, reason)| (class(reason), Rejection::label(reason))));
    if stages.iter().any(|stage| *stage != WAITING) {
        entries.push(("failed".to_owned(), "failed"));
    }
    if stages.contains(WAITING) {
        entries.push(("waiting".to_owned(), WAITING));
    }
    html::legend(entries).attr("aria-label", "Legend")
}

/// Label of a video that no stage has finished.
pub const WAITING: &str = "not processed";

/// What the rule of a reason measures, in words.
pub const fn quantity(rejection: Rejection) -> &'static str {
    match rejection {
        Rejection::NoSound => "share of frames with audio",
        Rejection::Quiet => "loudness",
        Rejection::NoSpeech => "share of speech",
        Rejection::OffScreenSpeaker => "probability that the visible mouth speaks",
        Rejection::Static => "duration",
        Rejection::NoPerson => "highest score of face and arms",
        Rejection::Small => "distance between the shoulders",
        Rejection::Face => "score of nose and eyes",
        Rejection::Turned => "shoulder width",
        Rejection::NoseOff => "horizontal distance from nose to neck",
        Rejection::Arms => "lowest score of shoulders and elbows",
        Rejection::OtherHand => "gap",
        Rejection::HandGap => "gap",
        Rejection::HandShare => "share of frames in which the hand is visible",
        Rejection::Jump => "neck movement per frame",
        Rejection::Cut => "remaining length",
        Rejection::Identity => "remaining length",
        Rejection::TooShort => "length",
        Rejection::Crowd => "share of frames with too many persons",
        Rejection::Bones => "deviation",
        Rejection::MissingJoints => "count",
        Rejection::ByHand => "length",
        _ => "measured",
    }
}

fn find(reason: &str) -> Option<usize> {
    Rejection::JUDGED.iter().position(|known| known.reason() == reason)
}

/// Rank of a reason in the order of the page; unknown reasons come last.
pub fn order(reason: &str) -> usize {
    find(reason).unwrap_or(Rejection::JUDGED.len())
}

/// Heading of a reason; empty for unknown reasons.
pub fn heading(reason: &str) -> &'static str {
    find(reason).map_or("", |at| Rejection::JUDGED[at].heading())
}

/// Heading of the reason, the measured value and the threshold; the ledger's message for unknown reasons.
pub fn description(rejected: &RejectedInterval) -> String {
    let [measured, threshold] = [rejected.measured, rejected.threshold].map(|value| with_unit(value, &rejected.unit));
    match Rejection::find(&rejected.reason, &rejected.unit) {
        Some(Rejection::ByHand) => rejected.message.clone(),
        Some(rejection) => {
            format!("{}: {} {measured}, threshold {threshold}", rejection.heading(), quantity(rejection))
        }
        None => format!("{}: measured {measured}, threshold {threshold}", rejected.message),
    }
}

pub fn class(reason: &str) -> String {
    if find(reason).is_some() { format!("r-{}", reason.replace(' ', "-")) } else { "r-unknown".to_owned() }
}
