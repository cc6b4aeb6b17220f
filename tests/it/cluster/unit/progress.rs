//! Tests of `orator_cluster::progress`.

#[test]
fn errors_that_differ_in_their_paths_have_one_reason() {
    let reason = |file: &str| {
        orator_cluster::progress::reason(&format!("cannot read {file}: {file}: expected a video; copy it again"))
    };
    assert_eq!(reason("/a/b.mp4"), "cannot read FILE: expected a video; copy it again");
    assert_eq!(reason("/a/b.mp4"), reason("videos/c.mp4"));
}
