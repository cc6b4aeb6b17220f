//! Assembles the page. The output depends on the analysis only.

use super::{charts, tables};
use crate::analyse::result::{StudyAnalysis, TaskAnalysis, TestOutcome};
use crate::analyse::text::{counted, list};
use orator_report::html::{Node, Page, Section, node};
use serde_json::Value;

pub fn html(analysis: &StudyAnalysis) -> String {
    let section = |id, title, body| Section { id, title, body };
    let mut sections = vec![section("meaning", "Conclusions", meaning(analysis))];
    if !analysis.hypotheses.is_empty() {
        sections.push(section("hypotheses", "Registered hypotheses", tables::hypotheses(analysis)));
    }
    sections.extend([
        section("charts", "Estimates and intervals", per_task(&analysis.tasks, |task| charts::task(task, analysis))),
        section("figures", "All statistics", statistics(analysis)),
        section("exclusions", "Exclusions", tables::exclusions(analysis)),
    ]);
    let page = Page {
        title: analysis.title.clone(),
        lead: lead(analysis),
        sections,
        style: include_str!("page.css"),
        script: "",
        data: Value::Null,
    };
    page.html()
}

fn lead(analysis: &StudyAnalysis) -> String {
    let summary = &analysis.exclusions;
    let tasks: Vec<String> = analysis.tasks.iter().map(|task| task.task.clone()).collect();
    let left_out = match summary.any_excluded() {
        true => format!(" ({} excluded)", counted(summary.n_votes - summary.n_votes_analysed, "vote")),
        false => String::new(),
    };
    format!(
        "{} from {}{left_out}. {}: {}.",
        counted(summary.n_votes_analysed, "vote"),
        counted(summary.n_participants_analysed, "participant"),
        if tasks.len() == 1 { "Task" } else { "Tasks" },
        list(&tasks)
    )
}

/// Body of each task under its name; the name is omitted if there is only one task.
fn per_task(tasks: &[TaskAnalysis], body: impl Fn(&TaskAnalysis) -> Vec<Node>) -> Vec<Node> {
    let title = |task: &TaskAnalysis| (tasks.len() > 1).then(|| node("h3").text(&task.task));
    tasks.iter().flat_map(|task| title(task).into_iter().chain(body(task))).collect()
}

fn meaning(analysis: &StudyAnalysis) -> Vec<Node> {
    let card = |task: &TaskAnalysis| {
        let conclusion = task.pooled().map(|share| share.conclusion);
        let conclusion = conclusion.or(task.pairs.first().map(|pair| pair.conclusion)).unwrap_or(TestOutcome::Untested);
        let class = match conclusion {
            TestOutcome::Equivalent => "card conclusion equivalent",
            TestOutcome::Inconclusive | TestOutcome::Untested => "card conclusion",
            _ => "card conclusion found",
        };
        let sentences = task.conclusions.iter().map(|sentence| node("p").text(sentence));
        node("div").class(class).child(node("h3").text(&task.task)).children(sentences)
    };
    let mut body = vec![node("div").class("conclusions").children(analysis.tasks.iter().map(card))];
    if !analysis.notes.is_empty() {
        body.push(node("h3").text("Notes"));
        body.push(node("ul").class("notes").children(analysis.notes.iter().map(|note| node("li").text(note))));
    }
    body
}

fn statistics(analysis: &StudyAnalysis) -> Vec<Node> {
    let about = "Registered: fixed and sealed before the first participant. Exploratory: all other statistics; they \
        can suggest a hypothesis, but not confirm one. Naive: the method treats votes as independent, although votes \
        of one participant or about one clip are correlated; listed for comparison with other publications.";
    let mut body = vec![node("p").text(about)];
    body.extend(per_task(&analysis.tasks, tables::task));
    if !analysis.without_exclusions.is_empty() {
        body.push(node("h3").text("Without exclusions"));
        body.push(node("p").text("All votes, by the same methods; none of these statistics is registered."));
        body.extend(per_task(&analysis.without_exclusions, tables::task));
    }
    body
}
