//! Peak memory does not grow with the length of a video. `ORATOR_LONG=1` (`make prove`) compares a 10-minute video
//! with a 1-minute one; otherwise a short twin.

use crate::clips::ffmpeg;
use crate::support::Project;
use std::time::Duration;

/// Peak resident memory in MiB of a whole run over one video.
fn peak_mib(project: &Project) -> f64 {
    let mut child = project.start(&["run", "--jobs", "1", "--to", "lift"]);
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0.0_f64;
    while child.try_wait().unwrap().is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
        peak = peak.max(kib.unwrap_or(0.0) / 1024.0);
        std::thread::sleep(Duration::from_millis(20));
    }
    peak
}

#[test]
fn peak_memory_stays_with_a_longer_video() {
    let (secs, times) = if std::env::var("ORATOR_LONG").is_ok() { (60.0, 10) } else { (4.0, 6) };
    let short = Project::with_clips("short", 1, secs);
    let long = Project::with_clips("long", 0, 0.0);
    let clip = short.clips().remove(0);
    let (clip, out) = (clip.to_string_lossy(), long.video("long.mp4"));
    assert!(ffmpeg(long.dir(), &format!("-stream_loop {} -i {clip} -c copy {}", times - 1, out.display())));
    let (short, long) = (peak_mib(&short), peak_mib(&long));
    eprintln!(
        "peak memory {short:.0} MiB at {secs} s, {long:.0} MiB at {} s: ratio {:.2}",
        secs * f64::from(times),
        long / short
    );
    assert!(short > 10.0 && long <= 1.2 * short, "{short:.0} MiB became {long:.0} MiB");
}
