//! Unit tests of `orator_base::stage::fingerprint`.

use orator_base::stage::fingerprint::Fingerprint;
use std::collections::BTreeMap;

#[test]
fn records_of_a_former_stage_name_equal_current_ones() {
    let of = |name: &str| Fingerprint {
        stage: name.to_owned(),
        version: 2,
        settings: serde_json::json!({ name: { "max_mb": 256 }, "tool": "1" }),
        inputs: BTreeMap::new(),
    };
    assert_eq!(of("shard").renamed(), of("dataset"));
    assert_eq!(of("lift").renamed(), of("lift"));
}
