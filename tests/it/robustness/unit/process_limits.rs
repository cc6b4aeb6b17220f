//! Tests of `orator_pipeline::process::limits`.

use anyhow::anyhow;
use orator_pipeline::process::limits::Limits;
use orator_pipeline::process::message::MediaHeader;
use std::path::Path;

fn header(secs: f64, image_size: [usize; 2], fps: f64) -> MediaHeader {
    MediaHeader { secs: Some(secs), image_size, fps: Some(fps) }
}

#[test]
fn limits_grow_with_the_video_and_stay_bounded() {
    let of = |secs, size| Limits::of_video(&header(secs, size, 30.0), 15.0, 0);
    let (small, long) = (of(10.0, [320, 180]), of(3600.0, [320, 180]));
    assert!(long.cpu_secs > 10 * small.cpu_secs && long.memory > small.memory);
    assert!(of(10.0, [1920, 1080]).memory > small.memory);
    for hostile in [f64::NAN, f64::INFINITY, -1.0, 1e300] {
        let claimed = Limits::of_video(&header(hostile, [usize::MAX; 2], hostile), 15.0, 0);
        assert!(claimed.memory <= Limits::of_machine().memory);
        assert!(claimed.cpu_secs < 2_000_000_000, "{claimed:?}");
    }
}

#[test]
fn the_exceeded_limit_is_named() {
    let limits = Limits::of_video(&header(10.0, [320, 180], 30.0), 15.0, 0);
    let passed = |cpu, time| limits.passed(cpu, time).unwrap_or_default();
    assert_eq!(passed([3000.0, 3000.0], [30_000, 800]), "");
    assert!(passed([0.0, 0.0], [900, 900]).contains("was idle for 15 min"));
    assert!(passed([5000.0, 5000.0], [5000, 0]).contains("reported no progress"));
    assert!(passed([8000.0, 0.0], [8000, 0]).contains("h of CPU time allowed for 70 s of 320x180 video"));
    assert!(passed([0.0, 0.0], [10_000_000, 0]).contains("took more than"));
}

#[test]
fn out_of_memory_errors_are_explained() {
    let limits = Limits::of_header();
    let explained = |text: &'static str| format!("{:#}", limits.explain(Path::new("a.mp4"), anyhow!(text)));
    assert_eq!(explained("no such file"), "no such file");
    let text = explained("cannot decode a.mp4: Cannot allocate memory");
    assert!(text.starts_with("a.mp4: reading it needs more than the ") && text.ends_with("Cannot allocate memory"));
    let of_header = Limits::of_header();
    assert_eq!(of_header.exceeded_by(of_header.memory), None);
    assert!(of_header.exceeded_by(of_header.memory + 1).unwrap().contains("MiB of memory allowed for the header"));
    assert!(text.contains(" MiB of memory allowed for the header of a file"), "{text}");
}
