//! Unit tests of `orator_dataset::config::seq2seq`.

use orator_dataset::config::seq2seq::Seq2seqSettings;

#[test]
fn the_learning_rate_decays_linearly_from_a_step_on() {
    let settings = Seq2seqSettings { learning_rate: 1.0, decay_start: 6, steps: 10, ..Default::default() };
    assert_eq!([0, 5, 6, 8, 9, 12].map(|step| settings.rate(step)), [1.0, 1.0, 1.0, 0.5, 0.25, 0.25]);
    assert_eq!(Seq2seqSettings::default().rate(19_999), 1e-3);
}
