//! Unit tests of `orator_study::analyse::exclusion`.

use orator_study::analyse::exclusion::exclude;
use orator_study::analyse::votes::columns::ColumnNames;
use orator_study::analyse::votes::read::VotesRead;
use orator_study::file::ExclusionRules;

#[test]
fn each_rule_is_counted_separately() {
    let text = "participant,clip,phase,conditions,response,expected,stalled_secs,unfocused_secs,reloads,completed\n\
        a,1,main,x|y,left,right,0,0,0,1\n\
        a,,attention-check,,42,42,0,0,0,1\n\
        b,1,main,x|y,left,right,0,0,0,1\n\
        b,,attention-check,,42,43,0,0,0,1\n\
        c,1,main,x|y,left,right,0,0,0,0\n\
        d,1,main,x|y,left,right,2.5,0,0,1\n\
        d,2,main,x|y,left,right,2.0,5.5,0,1\n\
        d,3,main,x|y,left,right,0,0,0,1\n\
        d,4,main,x|y,left,right,0,0,2,1\n";
    let path = tempfile::tempdir().unwrap();
    let file = path.path().join("votes.csv");
    std::fs::write(&file, text).unwrap();
    let read = VotesRead::of_file(&file, &ColumnNames::default(), None).unwrap();
    assert_eq!(read.rejected, []);
    let rules = ExclusionRules { reloaded: true, ..ExclusionRules::default() };
    let (included, summary) = exclude(&read, Some(&rules));
    let counts: Vec<_> = summary.rules.iter().map(|rule| (rule.n_participants, rule.n_votes)).collect();
    assert_eq!(counts, [(1, 1), (1, 1), (0, 1), (0, 1), (0, 1)]);
    assert_eq!(summary.rules[4].rule, "trial: page reloaded after a film began");
    assert_eq!(included.iter().map(|vote| vote.clip.as_str()).collect::<Vec<_>>(), ["1", "3"]);
    assert_eq!((summary.n_participants, summary.n_participants_analysed), (4, 2));
    assert_eq!((summary.n_votes, summary.n_votes_analysed, summary.any_excluded()), (7, 2, true));
    assert_eq!(exclude(&read, Some(&ExclusionRules::default())).0.len(), 3, "reloads exclude only by their rule");
    let (all, summary) = exclude(&read, None);
    assert_eq!((all.len(), summary.rules.len(), summary.registered), (7, 0, false));
}
