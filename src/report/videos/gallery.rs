//! Report section with pictures of the worst frames of every rule.

use super::pictures::MomentThumbnail;
use super::reasons;
use super::video::VideoSummary;
use super::worst::{Moment, Worst};
use crate::html::{Node, jpeg, node};
use orator_base::stage::rejection::Rejection;
use orator_base::text::clock;
use orator_base::text::counted;
use std::collections::BTreeMap;

/// Pictures by video index and frames of the moment.
pub type Pictures = BTreeMap<(usize, Vec<usize>), MomentThumbnail>;

/// Section with a row of pictures for each rule.
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
        let swatch = node("span").class(format!("swatch {}", reasons::class(reason)));
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
