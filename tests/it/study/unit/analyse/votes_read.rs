//! Tests of `orator_study::analyse::votes::read`.

use crate::fixtures::study::votes::example_vote;
use anyhow::Result;
use orator_study::analyse::votes::columns::ColumnNames;
use orator_study::analyse::votes::read::VotesRead;
use orator_study::plan::TaskDesign;
use orator_study::vote::{Response, ScreenSide, VOTE_COLUMNS};

fn read(text: &str) -> Result<VotesRead> {
    VotesRead::of_bytes(text.as_bytes(), false, &ColumnNames::default(), None)
}

#[test]
fn a_short_table_of_another_program_is_read() {
    let names = ColumnNames::parse("participant=worker, clip=Stimulus ID,correct=ok").unwrap();
    let text = "\u{feff}Worker;stimulus id;ok;response_secs\r\nw1;c1;1;2,5\r\n\"w;2\";c1;no;3\r\n\r\n";
    let read = VotesRead::of_bytes(text.as_bytes(), false, &names, None).unwrap();
    assert_eq!(read.votes.len(), 2, "{:?}", read.rejected);
    let vote = &read.votes[1];
    assert_eq!((vote.participant.as_str(), vote.trial, vote.task.as_str()), ("w;2", 1, "real-or-generated"));
    assert_eq!((&vote.response, &vote.conditions[1]), (&Response::Side(ScreenSide::Right), &"generated".to_owned()));
    assert_eq!(read.votes[0].response_secs, 2.5);
    assert!(read.absent.contains(&"completed") && !read.absent.contains(&"clip"));
}

#[test]
fn scores_in_separate_rows_become_pages() {
    let read = read("participant,clip,condition,score\na,1,N,80\na,1,M,20\na,2,N,70\nb,1,M,10\nb,1,M,11\n").unwrap();
    assert_eq!(read.votes.len(), 3);
    assert_eq!(read.votes[0].response, Response::Scores(vec![80, 20]));
    assert_eq!((read.votes[0].conditions.join(" "), read.votes[1].trial), ("N M".to_owned(), 2));
    assert_eq!(read.rejected.len(), 1);
    assert_eq!((read.rejected[0].line, read.rejected[0].reason.as_str()), (6, "duplicate: b already scored M of 1"));
}

#[test]
fn exported_votes_round_trip_in_both_formats() {
    let vote = example_vote(TaskDesign::Sliders, &["N", "M"], Response::Scores(vec![60, 0]));
    let line = serde_json::to_string(&vote).unwrap();
    let json = VotesRead::of_bytes(line.as_bytes(), true, &ColumnNames::default(), None).unwrap();
    assert_eq!(json.votes, std::slice::from_ref(&vote));
    let head = VOTE_COLUMNS.join(",");
    for response in ["\"{\"\"scores\"\":[60,0]}\"", "60|0"] {
        let row = format!("p,t,sliders,main,3,ellen/4,ellen,N|M,{response},,0.5,0,4.25,2,0,true");
        assert_eq!(read(&format!("{head}\n{row}\n")).unwrap().votes, std::slice::from_ref(&vote), "{response}");
    }
}

#[test]
fn rejected_rows_state_line_and_reason() {
    let head = "participant,clip,design,conditions,response,expected,trial\n";
    let rows = [
        ("a,1,turing,x|y,left,right,1", ""),
        ("a,1,turing,x|y,left,right,1", "duplicate: a already answered trial 1 of real-or-generated"),
        ("a,1,turing,x|y,up,right,2", "response is \"up\"; expected left or right"),
        ("a,1,turing,x,left,right,3", "expected two conditions, a response side and an expected side"),
        ("a,1,sliders,x|y,60|101,,4", "expected a score from 0 to 100 for each condition"),
        ("a,1,preference,x|x,1,,5", "expected two different conditions and a step from -2 to 2"),
        ("a,1,tuning,x|y,left,right,6", "design is \"tuning\"; expected turing, turing-single"),
        (",1,turing,x|y,left,right,7", "participant is empty"),
        ("a,,turing,x|y,left,right,8", "clip is empty"),
        ("a,1,turing,x|y,left,right,1.5", "trial is 1.5; expected an integer"),
        ("a,1,turing,x|y,left", "5 cells, but the header has 7"),
        ("a,1,turing,x|y,\"{\"\"side\"\":\"\"up\"\"}\",right,9", "expected an answer like"),
    ];
    let text: String = rows.iter().map(|(row, _)| format!("{row}\n")).collect();
    let read = read(&format!("{head}{text}")).unwrap();
    assert_eq!((read.votes.len(), read.rejected.len()), (1, rows.len() - 1));
    for ((row, (_, reason)), rejected) in rows.iter().enumerate().skip(1).zip(&read.rejected) {
        assert!(rejected.line == row as u64 + 2 && rejected.reason.contains(reason), "{reason}: {rejected:?}");
    }
}

#[test]
fn invalid_tables_are_errors() {
    for (text, expected) in [
        ("", "the file is empty"),
        ("participant,clip,correct\n", "no valid votes in 0 rows"),
        ("participant,clip\na,1\n", "no column with answers"),
        ("worker,clip,correct\na,1,1\n", "column \"participant\" not found"),
        ("participant,participant,clip,correct\na,a,1,1\n", "two columns are named \"participant\""),
        ("participant,clip,correct\na,1,maybe\n", "line 2: correct is \"maybe\"; expected 1 or 0"),
    ] {
        let error = format!("{:#}", read(text).unwrap_err());
        assert!(error.contains(expected), "{expected}: {error}");
    }
    let utf16 = VotesRead::of_bytes(b"\xff\xfea\0", false, &ColumnNames::default(), None).unwrap_err();
    assert!(utf16.to_string().contains("save it as UTF-8"));
    for (columns, expected) in
        [("worker", "invalid pair"), ("who=worker", "unknown field \"who\""), ("clip=", "no column name")]
    {
        assert!(ColumnNames::parse(columns).unwrap_err().to_string().contains(expected), "{expected}");
    }
    let names = ColumnNames::parse("clip=video").unwrap();
    let error = VotesRead::of_bytes(b"participant,clip,correct\na,1,1\n", false, &names, None).unwrap_err();
    assert!(error.to_string().contains("column \"video\" not found"), "{error}");
}

#[test]
fn keys_of_json_lines_match_like_columns_of_csv() {
    let csv = read("Participant, CLIP,Correct\na,1,1\nb,2,0\n").unwrap();
    let lines = "{\"Participant\":\"a\",\" CLIP\":1,\"Correct\":1}\n{\"PARTICIPANT\":\"b\",\"clip\":2,\"correct\":0}\n";
    let twice = format!("{lines}{{\"participant\":\"c\",\"clip\":3,\"Clip\":4,\"correct\":1}}\n");
    let json = |text: &str| VotesRead::of_bytes(text.as_bytes(), true, &ColumnNames::default(), None).unwrap();
    assert_eq!(json(lines), csv);
    assert_eq!(json(&twice).rejected[0].reason, "two keys are named \"clip\"");
}

#[test]
fn arbitrary_bytes_do_not_panic() {
    let head = b"participant,clip,condition,score,design,trial\n".to_vec();
    let mut state = 1_u32;
    for n in 0..400 {
        let mut bytes = head.clone();
        for _ in 0..n {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            bytes.push(b"a1,\"\n|;{\xff\xc3-.e\0"[(state >> 24) as usize % 14]);
        }
        let _ = VotesRead::of_bytes(&bytes, n % 2 == 0, &ColumnNames::default(), None);
        let _ = VotesRead::of_bytes(&bytes[head.len()..], true, &ColumnNames::default(), None);
    }
}
