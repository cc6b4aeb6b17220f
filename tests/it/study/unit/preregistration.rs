//! Tests of `orator_study::preregistration`.

use orator_study::file::{EXAMPLE, StudyFile};
use orator_study::preregistration::Preregistration;

#[test]
fn a_registration_matches_the_file_and_round_trips() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("study.toml");
    std::fs::write(&path, EXAMPLE).unwrap();
    let file = StudyFile::read(&path).unwrap();
    let registration = Preregistration::new(&file);
    assert_eq!((registration.participants, registration.sessions), (100, 150));
    assert!(registration.exclusion.reloaded && registration.exclusion == file.exclusion);
    assert_eq!(registration.tasks.iter().map(|task| task.votes).collect::<Vec<_>>(), [2000, 1000]);
    assert!(registration.hypotheses.iter().map(|hypothesis| &hypothesis.claim).eq(&file.hypothesis));
    assert!(
        registration.hypotheses[0]
            .statistic
            .starts_with("two one-sided tests of the share of correct responses against 50 % - 10")
    );
    let path = dir.path().join("preregistration.json");
    registration.write(&path).unwrap();
    assert_eq!(Preregistration::read(&path).unwrap(), registration);
    for (damage, message) in [("{", "is damaged"), ("{}", "is damaged"), (r#""version": 1"#, "version 9")] {
        let original = std::fs::read_to_string(&path).unwrap();
        let damaged = if damage.len() > 2 { original.replace(damage, r#""version": 9"#) } else { damage.to_owned() };
        std::fs::write(&path, damaged).unwrap();
        assert!(Preregistration::read(&path).unwrap_err().to_string().contains(message));
        std::fs::write(&path, original).unwrap();
    }
}
