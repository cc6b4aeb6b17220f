//! Responses that an address has collected from the pages of a bundle, one JSON a line. Nothing in them is signed: what
//! fits no session of the plan is dropped and counted.

use super::files::BundledPlan;
use crate::server::answer::check;
use crate::store::answers::GivenAnswer;
use anyhow::{Context, Result};
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Bytes of a line at most; the rest of a longer one is another line, which is none of ours.
const LONGEST_LINE: u64 = 64 * 1024;

/// Participants of a bundle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CollectedPosts {
    pub participants: Vec<CollectedParticipant>,
    /// Participants who have withdrawn; none of their answers is above.
    pub withdrawn: usize,
    /// Lines that are no JSON, of another study, out of order, or that do not fit their trial.
    pub dropped: usize,
}

/// What one participant has sent.
#[derive(Clone, Debug, PartialEq)]
pub struct CollectedParticipant {
    /// Random name, 24 hexadecimal digits.
    pub id: String,
    /// Index into the plan's sessions.
    pub session: usize,
    /// From the first trial on, without a gap.
    pub answers: Vec<GivenAnswer>,
    /// Whether every trial is answered.
    pub completed: bool,
}

#[derive(Deserialize)]
struct Post {
    study: String,
    kind: PostKind,
    session: String,
    participant: String,
    #[serde(flatten)]
    rest: serde_json::Map<String, Value>,
}

#[derive(Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum PostKind {
    Begin,
    Answer,
    Withdraw,
}

/// Reads the lines collected in `path` for the sessions of `bundled`. An answer that came twice counts once, the first
/// of two different ones.
///
/// # Errors
/// A file that cannot be read.
pub fn read_posts(bundled: &BundledPlan, path: &Path) -> Result<CollectedPosts> {
    let open = || File::open(path).with_context(|| format!("cannot read {}", path.display()));
    let mut lines = BufReader::new(open()?);
    let places: BTreeMap<&str, usize> = bundled.sessions.iter().enumerate().map(|(at, name)| (&name[..], at)).collect();
    let mut found: BTreeMap<String, (usize, BTreeMap<u32, GivenAnswer>)> = BTreeMap::new();
    let (mut withdrawn, mut dropped) = (BTreeSet::new(), 0);
    loop {
        let mut line = Vec::new();
        let n = lines.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line);
        if n.with_context(|| format!("cannot read {}", path.display()))? == 0 {
            break;
        }
        if line.trim_ascii().is_empty() {
            continue;
        }
        let post = serde_json::from_slice::<Post>(&line).ok().filter(|post| {
            post.study == bundled.study && places.contains_key(&post.session[..]) && is_name(&post.participant)
        });
        let Some(post) = post else {
            dropped += 1;
            continue;
        };
        let place = places[&post.session[..]];
        let (session, answers) = found.entry(post.participant.clone()).or_insert((place, BTreeMap::new()));
        match post.kind {
            _ if *session != place => dropped += 1,
            PostKind::Begin => {}
            PostKind::Withdraw => {
                withdrawn.insert(post.participant);
            }
            PostKind::Answer => match fitting(bundled, place, post.rest) {
                Some(answer) => {
                    let first = answers.entry(answer.position).or_insert_with(|| answer.clone());
                    dropped += usize::from(*first != answer);
                }
                None => dropped += 1,
            },
        }
    }
    found.retain(|id, _| !withdrawn.contains(id));
    let mut participants = Vec::new();
    for (id, (session, answers)) in found {
        let n = answers.len();
        let kept = answers.into_iter().zip(0..).take_while(|((position, _), at)| position == at);
        let answers: Vec<GivenAnswer> = kept.map(|((_, answer), _)| answer).collect();
        dropped += n - answers.len();
        let completed = answers.len() == bundled.plan.sessions[session].trials.len();
        participants.push(CollectedParticipant { id, session, answers, completed });
    }
    Ok(CollectedPosts { participants, withdrawn: withdrawn.len(), dropped })
}

fn is_name(text: &str) -> bool {
    text.len() == 24 && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// The answer in `rest`, if it fits its trial of the session.
fn fitting(bundled: &BundledPlan, session: usize, rest: serde_json::Map<String, Value>) -> Option<GivenAnswer> {
    let answer: GivenAnswer = serde_json::from_value(Value::Object(rest)).ok()?;
    let trial = bundled.plan.sessions[session].trials.get(answer.position as usize)?;
    check(&answer, trial, &bundled.plan.tasks[trial.task]).ok()?;
    Some(answer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{PlannedSession, PlannedTask, StudyPlan, TaskDesign, Trial, TrialPhase};
    use crate::response::{Response, ScreenSide};

    fn bundled() -> BundledPlan {
        let task =
            PlannedTask { name: "t".to_owned(), design: TaskDesign::Turing, replay: false, scale: String::new() };
        let films = vec!["0123456789abcdef".to_owned(); 2];
        let trial = Trial { task: 0, phase: TrialPhase::Main, films, expected: None };
        let sessions = vec![PlannedSession { trials: vec![trial.clone(), trial] }; 2];
        let plan = StudyPlan { version: 1, seed: 1, tasks: vec![task], sound_check: String::new(), sessions };
        BundledPlan { plan, study: "s".to_owned(), sessions: vec!["first".to_owned(), "second".to_owned()] }
    }

    fn line(kind: &str, session: &str, participant: &str, more: &str) -> String {
        format!(
            "{{\"study\":\"s\",\"kind\":\"{kind}\",\"session\":\"{session}\",\"participant\":\"{participant}\"{more}}}\n"
        )
    }

    fn answer(position: u32, side: &str) -> String {
        let times = "\"plays\":1,\"stalled_secs\":0,\"unfocused_secs\":0.5,\"response_secs\":1";
        format!(",\"position\":{position},\"response\":{{\"side\":\"{side}\"}},{times}")
    }

    #[test]
    fn what_fits_no_session_is_dropped_and_counted() {
        let [a, b, c] = ["a", "b", "c"].map(|letter| letter.repeat(24));
        let lines = [
            line("begin", "second", &a, ",\"consent\":true,\"language\":\"en\",\"parameters\":{}"),
            line("answer", "second", &a, &answer(0, "left")),
            line("answer", "second", &a, &answer(0, "left")),
            line("answer", "second", &a, &answer(1, "right")),
            line("answer", "first", &b, &answer(0, "left")),
            line("withdraw", "first", &b, ""),
            line("answer", "first", &c, &answer(1, "left")),
            "\n".to_owned(),
            // From here on nothing counts.
            line("answer", "second", &a, &answer(0, "right")),
            line("answer", "first", &a, &answer(0, "left")),
            line("answer", "second", &a, &answer(2, "left")),
            line("answer", "second", &a, &answer(1, "up")),
            line("answer", "third", &a, &answer(1, "left")),
            line("answer", "first", "<script>", &answer(0, "left")),
            line("answer", "first", &c, &answer(0, "left").replace("\"plays\":1", "\"plays\":0")),
            "{\"study\":\"other\"}\n".to_owned(),
            "no JSON\n".to_owned(),
        ];
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("posts.jsonl");
        std::fs::write(&path, [lines.concat().as_bytes(), b"\xff\xfe\n", &[b'x'; 100_000]].concat()).unwrap();
        let read = read_posts(&bundled(), &path).unwrap();
        assert_eq!(read.withdrawn, 1);
        let of_a = read.participants.iter().find(|one| one.id == a).unwrap();
        assert_eq!((of_a.session, of_a.completed, of_a.answers.len()), (1, true, 2));
        assert_eq!(of_a.answers[0].response, Response::Side(ScreenSide::Left));
        let of_c = read.participants.iter().find(|one| one.id == c).unwrap();
        assert_eq!((of_c.answers.len(), of_c.completed), (0, false), "the first trial is missing");
        assert_eq!(read.participants.len(), 2);
        // Nine lines of text, one of bytes, two halves of an endless one, one answer behind a gap.
        assert_eq!(read.dropped, 9 + 1 + 2 + 1);
    }
}
