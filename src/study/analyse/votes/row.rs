//! Converts a row of a table to a vote.

use crate::plan::{TaskDesign, TrialPhase};
use crate::vote::{Response, ScreenSide, StudyVote};
use serde::Deserialize;
use serde::de::IntoDeserializer as _;
use std::collections::BTreeMap;

pub const MAX_ROWS: usize = 2_000_000;

/// Default condition names for tables that do not name them.
const NATURAL: &str = "natural";
const GENERATED: &str = "generated";
const MAX_NAME_CHARS: usize = 200;

#[derive(Clone, Debug, PartialEq)]
pub struct RowCells {
    pub values: BTreeMap<&'static str, String>,
    /// Whether the comma is a decimal separator (`0,5`).
    pub has_decimal_comma: bool,
}

type RowResult<T> = std::result::Result<T, String>;

impl RowCells {
    fn get(&self, field: &str) -> Option<&str> {
        self.values.get(field).map(String::as_str).filter(|cell| !cell.is_empty())
    }

    fn name(&self, field: &str) -> RowResult<Option<String>> {
        match self.get(field) {
            Some(name) if name.chars().count() > MAX_NAME_CHARS => {
                Err(format!("{field} is longer than {MAX_NAME_CHARS} characters"))
            }
            Some(name) if name.contains(char::is_control) => Err(format!("{field} contains a control character")),
            name => Ok(name.map(str::to_owned)),
        }
    }

    fn needed(&self, field: &str) -> RowResult<String> {
        self.name(field)?.ok_or_else(|| format!("{field} is empty"))
    }

    fn number(&self, field: &str) -> RowResult<Option<f64>> {
        let Some(cell) = self.get(field) else { return Ok(None) };
        let point = if self.has_decimal_comma { cell.replace(',', ".") } else { cell.to_owned() };
        match point.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => Err(format!("{field} is \"{}\"; expected a number", short(cell))),
        }
    }

    fn integer(&self, field: &str, [low, high]: [i64; 2]) -> RowResult<Option<i64>> {
        let Some(number) = self.number(field)? else { return Ok(None) };
        let is_right = number.fract() == 0.0 && number >= low as f64 && number <= high as f64;
        is_right
            .then_some(Some(number as i64))
            .ok_or_else(|| format!("{field} is {number}; expected an integer from {low} to {high}"))
    }

    fn secs(&self, field: &str) -> RowResult<f64> {
        match self.number(field)?.unwrap_or(0.0) {
            secs if secs >= 0.0 => Ok(secs),
            secs => Err(format!("{field} is {secs}; expected seconds, 0 or more")),
        }
    }

    fn yes_or_no(&self, field: &str) -> RowResult<Option<bool>> {
        self.get(field)
            .map(|cell| truth(cell).ok_or_else(|| expected(field, cell, "1 or 0, true or false")))
            .transpose()
    }

    /// Value of a field with the same spelling as in JSON.
    fn keyword<T: for<'a> Deserialize<'a>>(&self, field: &str, words: &str) -> RowResult<Option<T>> {
        let Some(cell) = self.get(field) else { return Ok(None) };
        let word: serde::de::value::StrDeserializer<serde::de::value::Error> = cell.into_deserializer();
        T::deserialize(word).map(Some).map_err(|_| expected(field, cell, words))
    }
}

/// Converts a row to a vote, or gives the reason why it is not one. `design` applies if no column gives a design. A row
/// with one score becomes a vote on one condition; a row without a trial gets trial 0.
pub fn vote(cells: &RowCells, design: Option<TaskDesign>) -> RowResult<StudyVote> {
    let words = "turing, turing-single, preference, sliders or mismatch";
    let is_score = cells.get("score").is_some();
    let default = match (design, is_score, cells.get("step").is_some()) {
        (Some(design), _, _) => design,
        (None, true, _) => TaskDesign::Sliders,
        (None, false, true) => TaskDesign::Preference,
        (None, false, false) => TaskDesign::Turing,
    };
    let design = cells.keyword("design", words)?.unwrap_or(default);
    let phase = cells.keyword("phase", "practice, training, main or attention-check")?.unwrap_or(TrialPhase::Main);
    let (conditions, response, expected) = answer(cells, design, phase)?;
    let vote = StudyVote {
        participant: cells.needed("participant")?,
        task: cells.name("task")?.unwrap_or_else(|| title(design).to_owned()),
        design,
        phase,
        trial: cells.integer("trial", [0, i64::from(u32::MAX)])?.unwrap_or(0) as u32,
        clip: if phase == TrialPhase::Main { cells.needed("clip")? } else { cells.name("clip")?.unwrap_or_default() },
        speaker: cells.name("speaker")?.unwrap_or_default(),
        conditions,
        response,
        expected,
        stalled_secs: cells.secs("stalled_secs")?,
        unfocused_secs: cells.secs("unfocused_secs")?,
        response_secs: cells.secs("response_secs")?,
        plays: cells.integer("plays", [0, i64::from(u32::MAX)])?.unwrap_or(0) as u32,
        reloads: cells.integer("reloads", [0, i64::from(u32::MAX)])?.unwrap_or(0) as u32,
        completed: cells.yes_or_no("completed")?.unwrap_or(true),
    };
    check(&vote)?;
    Ok(vote)
}

fn title(design: TaskDesign) -> &'static str {
    match design {
        TaskDesign::Turing => "real-or-generated",
        TaskDesign::TuringSingle => "real-or-not",
        TaskDesign::Preference => "preference",
        TaskDesign::Sliders => "sliders",
        TaskDesign::Mismatch => "matched-or-mismatched",
    }
}

/// Conditions, response and expected response of a row.
fn answer(
    cells: &RowCells,
    design: TaskDesign,
    phase: TrialPhase,
) -> RowResult<(Vec<String>, Response, Option<Response>)> {
    let names = cells.get("conditions").map(|names| names.split('|').map(|name| name.trim().to_owned()).collect());
    let condition = cells.name("condition")?;
    let names: Option<Vec<String>> = names.or_else(|| condition.clone().map(|name| vec![name]));
    if let Some(cell) = cells.get("response") {
        let expected = cells.get("expected").map(|cell| response("expected", cell, design, phase)).transpose()?;
        return Ok((names.unwrap_or_default(), response("response", cell, design, phase)?, expected));
    }
    if let Some(is_correct) = cells.yes_or_no("correct")? {
        if !matches!(design, TaskDesign::Turing | TaskDesign::Mismatch) {
            return Err(
                "the column correct applies only to the designs turing and mismatch; give response and expected"
                    .to_owned(),
            );
        }
        let shown = condition.unwrap_or_else(|| GENERATED.to_owned());
        let conditions = if design == TaskDesign::Turing { vec![NATURAL.to_owned(), shown] } else { vec![shown; 2] };
        let chosen = if is_correct { ScreenSide::Left } else { ScreenSide::Right };
        return Ok((conditions, Response::Side(chosen), Some(Response::Side(ScreenSide::Left))));
    }
    if let Some(step) = cells.integer("step", [-2, 2])? {
        return Ok((names.unwrap_or_default(), Response::Step(step as i8), None));
    }
    match cells.integer("score", [0, 100])? {
        Some(score) => Ok((names.unwrap_or_default(), Response::Scores(vec![score as u8]), None)),
        None => Err("no answer".to_owned()),
    }
}

/// Parses a response given as JSON or as text: `left`, `real`, `-1`, `70|20`.
fn response(field: &str, cell: &str, design: TaskDesign, phase: TrialPhase) -> RowResult<Response> {
    if cell.starts_with('{') {
        return serde_json::from_str(cell).map_err(|_| expected(field, cell, "an answer like {\"side\":\"left\"}"));
    }
    if phase == TrialPhase::AttentionCheck
        && let Ok(number) = cell.parse()
    {
        return Ok(Response::Number(number));
    }
    let word = cell.to_lowercase();
    let (read, words) = match design {
        TaskDesign::Turing | TaskDesign::Mismatch => {
            let side = match word.as_str() {
                "left" => Some(ScreenSide::Left),
                "right" => Some(ScreenSide::Right),
                _ => None,
            };
            (side.map(Response::Side), "left or right")
        }
        TaskDesign::TuringSingle => {
            let named = [("real", true), ("generated", false)].into_iter().find(|(name, _)| *name == word);
            let is_real = named.map(|(_, is_real)| is_real).or_else(|| truth(&word));
            (is_real.map(Response::Real), "real or generated")
        }
        TaskDesign::Preference => (cell.parse().ok().map(Response::Step), "a step from -2 to 2"),
        TaskDesign::Sliders => {
            let scores = cell.split('|').map(|score| score.trim().parse().ok()).collect::<Option<_>>();
            (scores.map(Response::Scores), "scores from 0 to 100 like 70|20")
        }
    };
    read.ok_or_else(|| expected(field, cell, words))
}

/// Checks that a vote of the main phase fits the analysis of its design.
pub fn check(vote: &StudyVote) -> RowResult<()> {
    if vote.phase != TrialPhase::Main {
        return Ok(());
    }
    if vote.conditions.iter().any(String::is_empty) {
        return Err("a condition has an empty name".to_owned());
    }
    let n = vote.conditions.len();
    let is_side = |response: &Option<Response>| matches!(response, Some(Response::Side(_)));
    match (vote.design, &vote.response) {
        (TaskDesign::Turing | TaskDesign::Mismatch, Response::Side(_)) if n == 2 && is_side(&vote.expected) => Ok(()),
        (TaskDesign::Turing | TaskDesign::Mismatch, _) => {
            Err("expected two conditions, a response side and an expected side".to_owned())
        }
        (TaskDesign::TuringSingle, Response::Real(_)) if n == 1 && matches!(vote.expected, Some(Response::Real(_))) => {
            Ok(())
        }
        (TaskDesign::TuringSingle, _) => {
            Err("expected one condition, and real or generated as response and as expected response".to_owned())
        }
        (TaskDesign::Preference, Response::Step(-2..=2)) if n == 2 && vote.conditions[0] != vote.conditions[1] => {
            Ok(())
        }
        (TaskDesign::Preference, _) => Err("expected two different conditions and a step from -2 to 2".to_owned()),
        (TaskDesign::Sliders, Response::Scores(scores))
            if n >= 1 && scores.len() == n && scores.iter().all(|score| *score <= 100) =>
        {
            Ok(())
        }
        (TaskDesign::Sliders, _) => Err("expected a score from 0 to 100 for each condition".to_owned()),
    }
}

fn truth(cell: &str) -> Option<bool> {
    match cell.to_lowercase().as_str() {
        "1" | "true" | "yes" => Some(true),
        "0" | "false" | "no" => Some(false),
        _ => None,
    }
}

fn expected(field: &str, cell: &str, words: &str) -> String {
    format!("{field} is \"{}\"; expected {words}", short(cell))
}

fn short(cell: &str) -> String {
    cell.chars().take(40).collect()
}
