//! Unit tests of `orator_nn::seq2seq::config`.

use orator_nn::seq2seq::config::Config;

#[test]
fn the_number_of_blocks_is_stored_unless_it_is_two() -> anyhow::Result<()> {
    for (score_blocks, is_stored) in [(2, false), (5, true)] {
        let config = Config { score_blocks, ..Config::default() };
        let stored = serde_json::to_string(&config)?;
        assert_eq!(stored.contains("score_blocks"), is_stored);
        assert_eq!(serde_json::from_str::<Config>(&stored)?, config);
    }
    Ok(())
}
