//! Sealed assignments of conditions.

use orator_study::folder::StudyFolder;
use orator_study::seal::StudySeal;
use std::fs;

/// Study folder with the four sealed files and two films.
fn study() -> (tempfile::TempDir, StudyFolder) {
    let dir = tempfile::tempdir().unwrap();
    let folder = StudyFolder::new(dir.path());
    let files = [folder.study_file(), folder.plan(), folder.key(), folder.preregistration()];
    for path in files.into_iter().chain(["00", "01"].map(|film| folder.film(film))) {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, path.to_string_lossy().as_bytes()).unwrap();
    }
    (dir, folder)
}

#[test]
fn changed_added_and_missing_files_are_reported() {
    let (_dir, folder) = study();
    let seal = StudySeal::of(&folder).unwrap();
    assert_eq!(seal.files.len(), 6);
    assert!(StudySeal::verify(&folder).unwrap_err().to_string().contains("not a finished study"));
    seal.write(&folder).unwrap();
    fs::write(folder.responses(), "answers").unwrap();
    fs::write(folder.public().join(".hidden"), "").unwrap();
    assert_eq!(StudySeal::verify(&folder).unwrap(), seal);
    fs::write(folder.plan(), "another").unwrap();
    fs::write(folder.film("02"), "more").unwrap();
    fs::remove_file(folder.film("00")).unwrap();
    let message = StudySeal::verify(&folder).unwrap_err().to_string();
    assert!(
        message.contains("(changed: plan.json; added: public/films/02.mp4; missing: public/films/00.mp4)"),
        "{message}"
    );
    fs::remove_file(folder.key()).unwrap();
    assert!(StudySeal::of(&folder).unwrap_err().to_string().contains("has no key.json"));
    assert_eq!(seal.compare(&folder).unwrap().missing, ["key.json", "public/films/00.mp4"]);
}

#[test]
fn a_damaged_or_modified_seal_is_rejected() {
    let (_dir, folder) = study();
    StudySeal::of(&folder).unwrap().write(&folder).unwrap();
    let original = fs::read_to_string(folder.seal()).unwrap();
    let digit = original.find("plan.json\": \"").unwrap() + 13;
    let mut forged = original.clone();
    forged.replace_range(digit..=digit, if &original[digit..=digit] == "0" { "1" } else { "0" });
    for (text, message) in [
        (original[..original.len() / 2].to_owned(), "is damaged"),
        ("[]".to_owned(), "is damaged"),
        (forged, "was modified"),
        (original.replace("\"version\": 1", "\"version\": 2"), "version 2"),
    ] {
        fs::write(folder.seal(), text).unwrap();
        let error = StudySeal::verify(&folder).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn a_symlink_instead_of_a_film_is_rejected() {
    let (_dir, folder) = study();
    std::os::unix::fs::symlink("/etc/hostname", folder.film("03")).unwrap();
    assert!(StudySeal::of(&folder).unwrap_err().to_string().contains("not a regular file"));
}
