//! Unit tests of `orator_dataset::config::former`.

use orator_dataset::config::former::to_stored;
use orator_dataset::config::{GanSettings, Seq2seqSettings, Settings};

#[test]
fn stored_settings_have_their_former_names_and_are_read_back() {
    let settings = Settings::default();
    let stored = to_stored("pose2d", &settings.pose2d).unwrap();
    assert!(stored["person_follow"].is_number() && stored["box_smoothing"].is_null());
    assert!(to_stored("lift", &settings.lift).unwrap()["max_bone_change"].is_number());
    let seq2seq = to_stored("seq2seq", &Seq2seqSettings::default()).unwrap();
    assert_eq!((&seq2seq["reach"], &seq2seq["own_previous"]), (&"excursion".into(), &0.0.into()));
    assert_eq!(serde_json::from_value::<Seq2seqSettings>(seq2seq).unwrap(), Seq2seqSettings::default());
    let gan = GanSettings { final_lr_ratio: 0.25, ..GanSettings::default() };
    let stored = to_stored("gan", &gan).unwrap();
    assert_eq!(stored["fade_to"], 0.25);
    assert_eq!(serde_json::from_value::<GanSettings>(stored).unwrap(), gan);
}
