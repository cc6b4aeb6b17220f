//! Removal of a video from a plan.

use orator_cluster::forget::plans_naming;
use orator_dataset::forget::search::SearchTerm;
use std::fs;

#[test]
fn plans_that_hold_a_video_are_found_with_their_folders() {
    let dir = tempfile::tempdir().unwrap();
    let work = dir.path();
    let write = |name: &str, text: &str| {
        fs::create_dir_all(work.join(name).parent().unwrap()).unwrap();
        fs::write(work.join(name), text).unwrap();
    };
    let plan = |video: &str| format!("{{\n  \"program\": \"1\",\n  \"units\": [\"{video}\"]\n}}");
    write("plan.json", &plan("/v/a.mp4"));
    write("plan-0123456789ab/claims/0000/000000.claim.0001", "{}");
    write("plan-aaaaaaaaaaaa/workers/w.json", "/v/a.mp4");
    write("other.json", &plan("/v/b.mp4"));
    write("other-0123456789ab/workers/w.json", "/v/b.mp4");
    write("stage_times.json", "\"/v/a.mp4\"");
    write("timing/00.mkv", "an excerpt");
    write("takes-202403051430/a.mp4", "/v/a.mp4");
    write("other-bbbbbbbbbbbb/workers/w.json", "/v/a.mp4");
    write("other-bbbbbbbbbbbb/notes.txt", "a user's own");
    let terms = SearchTerm::name("path", "/v/a.mp4");
    let found = plans_naming(work, &terms).unwrap();
    let expected = ["plan-0123456789ab", "plan-aaaaaaaaaaaa", "plan.json", "timing"].map(|name| work.join(name));
    assert_eq!(found, expected);
    assert!(plans_naming(&work.join("none"), &terms).unwrap().is_empty());
}
