//! Elo ratings of eight systems with known strengths, from a table of pairwise votes that was made elsewhere.

use orator_study::analyse::outcome::Numbering;
use orator_study::analyse::pair::strengths;
use orator_study::analyse::result::{StatisticSettings, StrengthEstimate};
use orator_study::analyse::votes::columns::ColumnNames;
use orator_study::analyse::votes::read::VotesRead;
use orator_study::stats::bradley_terry::elo;
use orator_study::vote::StudyVote;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// True ratings; their mean is 1000.
const SYSTEMS: [(&str, f64); 8] = [
    ("natural", 1180.0),
    ("diffusion", 1110.0),
    ("flow", 1060.0),
    ("vq", 1005.0),
    ("gan", 985.0),
    ("seq2seq", 940.0),
    ("retrieval", 900.0),
    ("mismatched", 820.0),
];

/// Share of the votes that prefer a system with the first rating to one with the second, by the definition of Elo.
fn win_share(ratings: [f64; 2]) -> f64 {
    1.0 / (1.0 + 10f64.powf((ratings[1] - ratings[0]) / 400.0))
}

/// The 28 pairs: names and the share of the first one's wins.
fn pairs() -> Vec<([&'static str; 2], f64)> {
    let all = (0..SYSTEMS.len()).flat_map(|a| (a + 1..SYSTEMS.len()).map(move |b| [SYSTEMS[a], SYSTEMS[b]]));
    all.map(|pair| (pair.map(|(name, _)| name), win_share(pair.map(|(_, rating)| rating)))).collect()
}

const HEADER: &str = "worker,sequence,systems,step\n";

/// Reads a table with the columns `HEADER` and fits the ratings.
fn ratings(table: &str, n_draws: usize, seed: u64) -> BTreeMap<String, StrengthEstimate> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("votes.csv");
    std::fs::write(&path, table).unwrap();
    let names = ColumnNames::parse("participant=worker,clip=sequence,conditions=systems").unwrap();
    let read = VotesRead::of_file(&path, &names, None).unwrap();
    assert_eq!(read.rejected, []);
    let votes: Vec<&StudyVote> = read.votes.iter().collect();
    let conditions: Vec<String> = SYSTEMS.iter().map(|(name, _)| (*name).to_owned()).collect();
    let settings = StatisticSettings { n_draws, seed, ..StatisticSettings::default() };
    let rows = strengths(&votes, &Numbering::new(&votes), &conditions, &settings).unwrap();
    rows.into_iter().map(|row| (row.condition.clone(), row)).collect()
}

/// Votes as often as expected: of 1,000 votes per pair, half shown in each order, the rounded number for each side.
#[test]
fn expected_votes_of_eight_systems_give_their_elo_within_a_point() {
    let mut table = HEADER.to_owned();
    for ([first, second], share) in pairs() {
        for n in 0..1000 {
            let wins = f64::from(n) < (1000.0 * share).round();
            let (shown, step) = match n % 2 {
                0 => (format!("{first}|{second}"), if wins { -2 } else { 2 }),
                _ => (format!("{second}|{first}"), if wins { 2 } else { -2 }),
            };
            writeln!(table, "w{},s{},{shown},{step}", n % 50, n % 40).unwrap();
        }
    }
    let found = ratings(&table, 0, 1);
    for (name, truth) in SYSTEMS {
        let rating = found[name].elo;
        assert!((rating - truth).abs() < 1.0, "{name}: {rating}, expected {truth}");
    }
}

/// Random votes of 60 participants: 95 % intervals cover the true ratings about as often as they state.
#[test]
fn intervals_cover_the_true_elo_about_as_often_as_they_state() {
    const STUDIES: u64 = 60;
    let mut n_covered = 0;
    for study in 0..STUDIES {
        let mut rng = ChaCha8Rng::seed_from_u64(study);
        let mut table = HEADER.to_owned();
        for worker in 0..60 {
            for ([first, second], share) in pairs() {
                let step = if rng.random_bool(share) { -2 } else { 2 };
                writeln!(table, "w{worker},s{},{first}|{second},{step}", rng.random_range(0..40)).unwrap();
            }
        }
        let found = ratings(&table, 200, study);
        let covers = |(name, truth): &(&str, f64)| {
            let ends = found[*name].interval.as_ref().unwrap().ends;
            (elo(ends.low)..=elo(ends.high)).contains(truth)
        };
        n_covered += SYSTEMS.iter().filter(|system| covers(system)).count();
    }
    let share = n_covered as f64 / (STUDIES as f64 * SYSTEMS.len() as f64);
    assert!((0.91..=0.98).contains(&share), "{n_covered} intervals, {share}");
}
