//! Page of an evaluation: conclusions, the table with its baselines, charts, and a player with audio. The bytes depend
//! only on the table and the clips.

use super::charts::{joints, speeds};
use super::player;
use super::player::Excerpt;
use super::table;
use crate::html::{Node, Page, Section, node, video};
use anyhow::Result;
use orator_base::text::counted;
use orator_base::text::length;
use orator_gesture::evaluate::clips::clips::EvalClips;
use orator_gesture::evaluate::conclusion::conclusion::{
    Answer, Conclusion, better_than_constant_pose, depends_on_audio,
};
use orator_gesture::evaluate::conclusion::text;
use orator_gesture::evaluate::table::table::{PredictorRow, Table};
use serde_json::json;

/// HTML of the page; `film`: MP4 of generated and true motion side by side, shown after the conclusions.
pub fn html(table: &Table, clips: &EvalClips, title: &str, film: Option<&[u8]>) -> Result<String> {
    let excerpts = player::choose(clips)?;
    let section = |id, title, body| Section { id, title, body };
    let mut page = Page {
        title: title.to_owned(),
        lead: lead(table),
        sections: vec![
            section("conclusions", "Conclusions", conclusions(table)),
            section(
                "comparison",
                "Ground truth and prediction",
                with_checkpoint_note(table, player::body(&excerpts, table)),
            ),
            section("metrics", "All metrics", table::body(table)),
            section("joints", "Accuracy by joint", with_checkpoint_note(table, joints(table, clips))),
            section("speeds", "Speed and jerk", with_checkpoint_note(table, speeds(clips))),
            section("definitions", "Definitions of the metrics", table::definitions(table)),
        ],
        style: include_str!("page.css"),
        script: include_str!("player.js"),
        data: json!({
            "bones": player::bones(),
            "excerpts": excerpts.iter().map(Excerpt::data).collect::<Vec<_>>(),
        }),
    };
    if let Some(film) = film {
        page.sections.insert(1, section("film", "Film", vec![video(film, "Generated and true motion side by side")]));
    }
    Ok(page.html())
}

fn lead(table: &Table) -> String {
    format!(
        "{}, {}, {} of motion at {}{}.",
        counted(table.n_clips, "clip"),
        counted(table.n_frames, "frame"),
        length(table.secs),
        table.settings.fps,
        if table.with_sound { ", with audio" } else { ", without audio" }
    )
}

/// Adds a note above a section that shows only the first of the checkpoints; unchanged without checkpoints.
fn with_checkpoint_note(table: &Table, body: Vec<Node>) -> Vec<Node> {
    let first = table.predictions().find_map(|own| own.checkpoint.as_ref());
    let note = first.map(|of| node("p").text(format!("This section shows the first checkpoint, {}.", of.name)));
    note.into_iter().chain(body).collect()
}

/// Conclusions with the votes that support them, the compared predictors, and notes.
fn conclusions(table: &Table) -> Vec<Node> {
    let card = |(own, conclusion): (&PredictorRow, Conclusion)| {
        let class = format!("card conclusion {}", conclusion.word.replace(' ', "-"));
        let votes = conclusion.votes.iter().map(|vote| {
            let (class, outcome) = match vote.answer {
                Answer::Yes => ("better", "better than"),
                Answer::No => ("worse", "worse than"),
                Answer::Inconclusive => ("undecided", "no significant difference from"),
            };
            let description = format!("{}: {outcome} {}", vote.metric, vote.against.name());
            node("li").class(format!("vote {class}")).text(description)
        });
        let of = own.checkpoint.as_ref().map(|of| format!("{}: ", of.name)).unwrap_or_default();
        let card = node("div").class(class).child(node("p").text(format!("{of}{}", conclusion.sentence)));
        card.child(node("ul").class("votes").children(votes))
    };
    let both = |own| [(own, better_than_constant_pose(table, own)), (own, depends_on_audio(table, own))];
    let mut body = vec![node("div").class("conclusions").children(table.predictions().flat_map(both).map(card))];
    let rows = table.rows.iter().map(|row| {
        let name = node("th").attr("scope", "row").text(row.name());
        node("tr").child(name).child(node("td").text(&row.description))
    });
    body.push(node("h3").text("Compared predictors"));
    body.push(node("table").class("predictors").child(node("tbody").children(rows)));
    let notes: Vec<String> = table.notes.iter().cloned().chain(text::undefined(table)).collect();
    if !notes.is_empty() {
        body.push(node("h3").text("Notes"));
        body.push(node("ul").class("notes").children(notes.iter().map(|note| node("li").text(note))));
    }
    body
}
