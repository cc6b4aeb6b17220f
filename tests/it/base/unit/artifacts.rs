//! Unit tests of `orator_base::stage::artifacts`.

use orator_base::stage::artifacts::StageName;

#[test]
fn stages_parse_by_name() {
    for stage in StageName::ALL {
        assert_eq!(stage.as_str().parse::<StageName>().unwrap(), stage);
    }
    assert!("lit".parse::<StageName>().unwrap_err().to_string().contains("segment, lift, transcribe, dataset"));
}
