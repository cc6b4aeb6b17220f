//! Page of an evaluation: conclusions, the table with its baselines, charts, a player with audio, and the definitions
//! of the metrics. The bytes depend only on the table and the clips.

use super::charts::{joints, speeds};
use super::player::{self, Excerpt};
use crate::html::{Node, Page, Section, node, video};
use anyhow::Result;
use orator_base::text::{counted, length};
use orator_gesture::evaluate::baseline::baselines::PredictorKind;
use orator_gesture::evaluate::clips::clips::EvalClips;
use orator_gesture::evaluate::conclusion::conclusion::{
    Answer, Conclusion, against_constant_pose, better_than_constant_pose, depends_on_audio,
};
use orator_gesture::evaluate::conclusion::{labels, text};
use orator_gesture::evaluate::table::table::{N_COSTLY_DRAWS, N_DRAWS, PredictorRow, Table};
use orator_gesture::metrics::catalogue::Definition;
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
            section("metrics", "All metrics", body(table)),
            section("joints", "Accuracy by joint", with_checkpoint_note(table, joints(table, clips))),
            section("speeds", "Speed and jerk", with_checkpoint_note(table, speeds(clips))),
            section("definitions", "Definitions of the metrics", definitions(table)),
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

/// Groups of metrics by prefixes of their names; the last group contains the rest.
const GROUPS: [(&str, &[&str]); 4] = [
    ("Joint positions", &["pck", "l1", "mpjpe", "p_mpjpe", "maje", "acceleration_error"]),
    ("Distribution of poses and motion", &["frechet", "l1div", "average_pairwise", "cca"]),
    ("Speed, acceleration and jerk", &["speed", "acceleration", "jerk", "hellinger", "bone"]),
    ("Audio and other metrics", &[""]),
];

/// Table of all metrics, grouped.
pub fn body(table: &Table) -> Vec<Node> {
    let head = |text: &str| node("th").attr("scope", "col").class("num").text(text);
    let heads = table.rows.iter().map(|row| head(&row.name()));
    let first = node("th").attr("scope", "col").text("");
    let against = table.predictions().map(|own| {
        let of = own.checkpoint.as_ref().map(|of| format!("{} ", of.name)).unwrap_or_default();
        node("th").attr("scope", "col").class("against").text(format!("{of}vs. constant pose"))
    });
    let width = table.rows.len() + 1 + table.predictions().count();
    let mut rows: Vec<Node> = Vec::new();
    for (group, (title, _)) in GROUPS.iter().enumerate() {
        let of_group = (0..table.definitions.len()).filter(|i| group_of(&table.definitions[*i]) == group);
        let mut last = String::new();
        let shown: Vec<Node> = of_group.filter_map(|index| row(table, index, &mut last)).collect();
        if !shown.is_empty() {
            let title = node("th").attr("colspan", width).attr("scope", "rowgroup").text(title);
            rows.push(node("tr").class("group").child(title));
            rows.extend(shown);
        }
    }
    let drawn = format!(
        "In brackets or in the tooltip: 95 % confidence intervals from {N_DRAWS} bootstrap draws of the blocks \
         (Frechet distances and correlations: {N_COSTLY_DRAWS}). Column vs. constant pose: the prediction compared \
         with the better of the constant poses, each metric tested separately by sign flips of the blocks."
    );
    let table = crate::html::table("metrics", std::iter::once(first).chain(against).chain(heads), rows);
    vec![node("p").class("small").text(drawn), node("div").class("scroll").attr("tabindex", "0").child(table)]
}

fn group_of(definition: &Definition) -> usize {
    // The longest matching prefix decides: acceleration_error is a position error, acceleration is not.
    let starts =
        GROUPS.iter().enumerate().flat_map(|(group, (_, starts))| starts.iter().map(move |start| (group, *start)));
    let fitting = starts.filter(|(_, start)| definition.name.starts_with(start));
    fitting.max_by_key(|(_, start)| start.len()).map_or(GROUPS.len() - 1, |(group, _)| group)
}

/// Row of a metric; `None` if it is not shown. A metric that differs from `last` only in its body part shows only that.
fn row(table: &Table, index: usize, last: &mut String) -> Option<Node> {
    let definition = &table.definitions[index];
    if !table.is_shown(index) {
        return None;
    }
    let full_name = labels::name_without_part(definition);
    let is_part = *last == full_name && !labels::part(definition).is_empty();
    let name = node("th").attr("scope", "row").attr("title", definition.formula);
    let name = if is_part {
        name.class("part")
            .child(node("span").class("visually-hidden").text(format!("{full_name}, ")))
            .text(labels::part(definition))
    } else {
        let unit = labels::unit(definition);
        let unit = if unit.is_empty() { String::new() } else { format!("{unit}, ") };
        let small = format!("{unit}{}", labels::direction(definition.better));
        name.text(labels::name(definition)).child(node("small").text(small))
    };
    *last = full_name;
    let against = table.predictions().map(|own| {
        let (class, outcome) = match against_constant_pose(table, own, index) {
            Some(Answer::Yes) => ("yes", "better"),
            Some(Answer::No) => ("no", "worse"),
            Some(Answer::Inconclusive) => ("undecided", "no significant difference"),
            None => ("", ""),
        };
        node("td").class(format!("against {class}")).text(outcome)
    });
    let cells = table.rows.iter().map(|row| {
        let estimate = &row.values[index];
        let cell = node("td").class(if row.kind == PredictorKind::Prediction { "num own" } else { "num" });
        let cell = cell.text(labels::number(definition, estimate.value));
        if !estimate.interval.is_finite() {
            return cell;
        }
        let [low, high] =
            [estimate.interval.low, estimate.interval.high].map(|value| labels::number(definition, value));
        let interval = format!("[{low}, {high}]");
        if row.kind == PredictorKind::Prediction {
            cell.child(node("small").text(interval))
        } else {
            cell.attr("title", interval)
        }
    });
    Some(node("tr").child(name).children(against).children(cells))
}

/// All definitions with their parameters and hashes, including those of metrics of the ground truth alone.
pub fn definitions(table: &Table) -> Vec<Node> {
    let item = |definition: &Definition| {
        let name = node("summary").text(labels::name(definition));
        let formula = node("p").text(format!("{}.", definition.formula));
        let parameters = node("p").class("small").child(node("code").text(&definition.parameters));
        let hash = format!("{} ({}), hash {}", definition.name, definition.part, definition.hash());
        let hash = node("p").class("small").child(node("code").text(hash));
        node("details").child(name).child(formula).child(parameters).child(hash)
    };
    let about = "Values are comparable if their hashes are equal: a hash covers the definition and all parameters. \
                 `orator evaluate compare A.json B.json` rejects metrics with different hashes.";
    vec![node("p").text(about), node("div").class("definitions").children(table.definitions.iter().map(item))]
}
