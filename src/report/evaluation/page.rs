//! Page of an evaluation: conclusions, the table with its baselines, charts, and a player with sound. The bytes depend
//! only on the table and the clips.

use super::charts::{joints, speeds};
use super::player;
use super::player::Excerpt;
use super::table;
use crate::html::{Node, Page, Section, node};
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

/// HTML of the page.
pub fn html(table: &Table, clips: &EvalClips, title: &str) -> Result<String> {
    let excerpts = player::choose(clips)?;
    let section = |id, title, body| Section { id, title, body };
    let page = Page {
        title: title.to_owned(),
        lead: lead(table),
        sections: vec![
            section("meaning", "What it means", meaning(table)),
            section("watch", "Truth and prediction", with_checkpoint_note(table, player::body(&excerpts, table))),
            section("figures", "All figures", table::body(table)),
            section("joints", "Which joints are right", with_checkpoint_note(table, joints(table, clips))),
            section("speeds", "How fast it moves", with_checkpoint_note(table, speeds(clips))),
            section("definitions", "Exact definitions", table::definitions(table)),
        ],
        style: include_str!("page.css"),
        script: include_str!("player.js"),
        data: json!({
            "bones": player::bones(),
            "excerpts": excerpts.iter().map(Excerpt::data).collect::<Vec<_>>(),
        }),
    };
    Ok(page.html())
}

fn lead(table: &Table) -> String {
    format!(
        "{} of {}, {} of motion at {}{}.",
        counted(table.n_clips, "clip"),
        counted(table.n_frames, "frame"),
        length(table.secs),
        table.settings.fps,
        if table.with_sound { ", with sound" } else { ", without sound" }
    )
}

/// Adds a note above a section that shows only the first of the checkpoints; unchanged without checkpoints.
fn with_checkpoint_note(table: &Table, body: Vec<Node>) -> Vec<Node> {
    let first = table.predictions().find_map(|own| own.checkpoint.as_ref());
    let note = first.map(|of| node("p").text(format!("The prediction here is that of {}, given first.", of.name)));
    note.into_iter().chain(body).collect()
}

/// Conclusions with the votes that support them, the compared predictors, and notes.
fn meaning(table: &Table) -> Vec<Node> {
    let card = |(own, verdict): (&PredictorRow, Conclusion)| {
        let class = format!("card verdict {}", verdict.word.replace(' ', "-"));
        let votes = verdict.votes.iter().map(|vote| {
            let (class, words) = match vote.answer {
                Answer::Yes => ("better", "better than"),
                Answer::No => ("worse", "worse than"),
                Answer::Undecided => ("undecided", "not told apart from"),
            };
            let description = format!("{}: {words} {}", vote.metric, vote.against.name());
            node("li").class(format!("vote {class}")).text(description)
        });
        let of = own.checkpoint.as_ref().map(|of| format!("{}: ", of.name)).unwrap_or_default();
        let card = node("div").class(class).child(node("p").text(format!("{of}{}", verdict.sentence)));
        card.child(node("ul").class("votes").children(votes))
    };
    let verdicts = |own| [(own, better_than_constant_pose(table, own)), (own, depends_on_audio(table, own))];
    let mut body = vec![node("div").class("verdicts").children(table.predictions().flat_map(verdicts).map(card))];
    let rows = table.rows.iter().map(|row| {
        let name = node("th").attr("scope", "row").text(row.name());
        node("tr").child(name).child(node("td").text(&row.description))
    });
    body.push(node("h3").text("What is measured beside each other"));
    body.push(node("table").class("who").child(node("tbody").children(rows)));
    let notes: Vec<String> = table.notes.iter().cloned().chain(text::undefined(table)).collect();
    if !notes.is_empty() {
        body.push(node("h3").text("Notes"));
        body.push(node("ul").class("notes").children(notes.iter().map(|note| node("li").text(note))));
    }
    body
}
