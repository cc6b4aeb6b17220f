//! Long run: the analysis on simulated studies with a known effect. Coverage of intervals, error rates of tests, power
//! compared with the plan, and the error of the naive binomial test.

use orator_study::analyse::outcome::BinaryVote;
use orator_study::analyse::result::{ShareAnalysis, ShareMeasure, StatisticSettings};
use orator_study::analyse::share::{ShareCell, share};
use orator_study::analyse::statistic::StatisticMethod;
use orator_study::power::{CrossedDesign, CrossedEffects, crossed_votes};
use orator_study::power::{PowerQuestion, power, simulated};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;

const STUDIES: u64 = 2000;
/// Simulations from which power is predicted.
const N_POWER_SIMULATIONS: usize = 10_000;
const METHODS: [StatisticMethod; 5] = [
    StatisticMethod::Crossed,
    StatisticMethod::Sides,
    StatisticMethod::Participants,
    StatisticMethod::Wilson,
    StatisticMethod::Binomial,
];

/// Shares of studies, percent.
#[derive(Default)]
struct Rates {
    covered: f64,
    rejected: f64,
    has_interval: bool,
    has_test: bool,
}

fn rates(studies: &[ShareAnalysis], truth: f64, method: StatisticMethod) -> Rates {
    let percent = |n: usize| 100.0 * n as f64 / studies.len() as f64;
    let interval = |study: &&ShareAnalysis| {
        study.statistics.interval(method).is_some_and(|interval| interval.low <= truth && truth <= interval.high)
    };
    let test = |study: &&ShareAnalysis| study.statistics.test(method).is_some_and(|test| test.p < 0.05);
    Rates {
        covered: percent(studies.iter().filter(interval).count()),
        rejected: percent(studies.iter().filter(test).count()),
        has_interval: studies[0].statistics.interval(method).is_some(),
        has_test: studies[0].statistics.test(method).is_some(),
    }
}

/// Prints the rates of a scenario and returns those of each method.
fn scenario(name: &str, truth: f64, study: impl Fn(u64) -> ShareAnalysis + Sync + Send) -> Vec<Rates> {
    let studies: Vec<ShareAnalysis> = (0..STUDIES).into_par_iter().map(study).collect();
    eprintln!("\n{name}, {STUDIES} studies, true share {:.0} %", 100.0 * truth);
    let all: Vec<Rates> = METHODS.iter().map(|method| rates(&studies, truth, *method)).collect();
    for (method, rates) in METHODS.iter().zip(&all).filter(|(_, rates)| rates.has_interval || rates.has_test) {
        let covered = if rates.has_interval { format!("covers {:5.1} %", rates.covered) } else { " ".repeat(14) };
        let rejected = if rates.has_test { format!("rejects {:5.1} %", rates.rejected) } else { String::new() };
        eprintln!("  {:<38} {covered}  {rejected}", method.name());
    }
    all
}

fn settings() -> StatisticSettings {
    StatisticSettings { n_draws: 0, with_models: false, ..StatisticSettings::default() }
}

/// Participants who cannot distinguish the conditions but prefer a side.
fn with_sides(design: &CrossedDesign, stream: u64) -> ShareAnalysis {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    rng.set_stream(stream);
    let none = CrossedEffects { share: 0.5, sd_participants: 0.0, sd_clips: 0.0 };
    let mut prefers = vec![0.0; design.n_participants];
    prefers.iter_mut().for_each(|odds: &mut f64| *odds = rng.sample::<f64, _>(StandardNormal));
    let votes = crossed_votes(design, &none, 7, stream).into_iter().map(|mut vote| {
        let (is_left, odds): (bool, f64) = (rng.random(), prefers[vote.participant]);
        let chose_left = rng.random::<f64>() < 1.0 / (1.0 + (-odds).exp());
        vote.score = f64::from(u8::from(is_left != chose_left));
        BinaryVote { vote, speaker: "", condition: "", sides: Some([is_left, chose_left]) }
    });
    let votes = votes.collect();
    share(&ShareCell { measure: ShareMeasure::GeneratedChosen, speaker: None, condition: None, votes }, &settings())
}

#[test]
#[ignore = "minutes: make prove-study"]
fn coverage_error_rates_and_power_are_as_predicted() {
    let designs = [
        ("100 participants, 20 votes each, 40 clips", CrossedDesign { n_participants: 100, n_trials: 20, n_clips: 40 }),
        ("40 participants, 10 votes each, 20 clips", CrossedDesign { n_participants: 40, n_trials: 10, n_clips: 20 }),
    ];
    let [crossed, sides, _, _, binomial] = [0, 1, 2, 3, 4];
    for (name, design) in designs {
        for (sd_participants, sd_clips) in [(0.3, 0.3), (0.6, 0.6)] {
            for truth in [0.5, 0.55] {
                let effects = CrossedEffects { share: truth, sd_participants, sd_clips };
                let title = format!("{name}, standard deviations {sd_participants} and {sd_clips}");
                let rates = scenario(&title, truth, |k| simulated(&design, &effects, &settings(), 3, k));
                assert!((93.0..=97.0).contains(&rates[crossed].covered), "{}", rates[crossed].covered);
                if truth == 0.5 {
                    assert!((4.0..=6.0).contains(&rates[crossed].rejected), "{}", rates[crossed].rejected);
                    assert!(rates[binomial].rejected > 6.0, "{}", rates[binomial].rejected);
                    continue;
                }
                let question = PowerQuestion {
                    n_trials: design.n_trials,
                    n_clips: design.n_clips,
                    sd_participants,
                    sd_clips,
                    power: 0.9,
                    effect: truth,
                    bound: 0.1,
                    n_simulations: N_POWER_SIMULATIONS,
                    seed: 11,
                };
                let is_found = |study: &ShareAnalysis| {
                    study.statistics.test(StatisticMethod::Crossed).is_some_and(|test| test.p < 0.05)
                };
                let predicted = 100.0 * power(&question, design.n_participants, truth, &is_found).power;
                eprintln!("  power predicted {predicted:.1} %, found {:.1} %", rates[crossed].rejected);
                assert!((predicted - rates[crossed].rejected).abs() <= 3.0);
            }
        }
        let rates = scenario(&format!("{name}, no effect, sides preferred"), 0.5, |k| with_sides(&design, k));
        assert!(rates[sides].rejected <= 6.0 && rates[binomial].rejected <= 6.0);
    }
}
