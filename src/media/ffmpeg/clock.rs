//! One clock for recordings that were joined end to end. Transport and program streams keep the time stamps of each
//! recording, so their clock jumps at a join. From a jump on, the packets of all streams are shifted by the same time,
//! so that the pictures continue where those of the previous recording ended.

use super::source;
use anyhow::Result;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::{Packet, media};
use std::path::{Path, PathBuf};

/// Containers whose clock may jump, and the length of its ticks, seconds: a numerator and a denominator.
const FORMATS: [&str; 2] = ["mpegts", "mpeg"];
const TICK: (i32, i32) = (1, 90_000);
const SECOND: i64 = 90_000;
/// A packet earlier than the previous one by more than `MAX_BACK`, or later by more than `MAX_GAP`, is on another
/// clock, ticks. The program `ffmpeg` uses the same limit of 10 s, so transcripts made from its output agree.
const MAX_BACK: i64 = SECOND / 2;
const MAX_GAP: i64 = 10 * SECOND;
/// A shorter run, after which the previous clock continues, consists of damaged time stamps, ticks.
const MAX_GLITCH: i64 = SECOND;
/// Maximum number of runs of a stream; the clock of a file with more is not corrected.
const MAX_RUNS: usize = 1000;

/// Clock of the packets of one stream, in the order of the file.
pub(crate) struct StreamClock {
    path: PathBuf,
    stream_idx: usize,
    n_packets: usize,
    last: Option<i64>,
    /// Corrected runs; `None` as long as the clock has not jumped.
    shifts: Option<Vec<RunShift>>,
    current: i64,
    joins: Vec<i64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct RunShift {
    /// Number of the first packet in its stream.
    first: usize,
    /// Ticks to add to all times of the run.
    ticks: i64,
    /// Whether another recording begins here.
    is_join: bool,
}

impl StreamClock {
    /// Clock of stream `stream_idx` of `input`, the opened `path`; `None` for a container whose clock does not jump.
    pub(crate) fn new(path: &Path, input: &Input, stream_idx: usize) -> Result<Option<Self>> {
        let stream = input.stream(stream_idx).filter(|stream| {
            let base = stream.time_base();
            FORMATS.contains(&input.format().name()) && (base.numerator(), base.denominator()) == TICK
        });
        let Some(stream) = stream else { return Ok(None) };
        // The first packet of sound may belong to a later recording.
        let is_sound = stream.parameters().medium() == media::Type::Audio;
        let shifts = is_sound.then(|| read_shifts(path, stream_idx)).transpose()?;
        let path = path.to_owned();
        Ok(Some(Self { path, stream_idx, n_packets: 0, last: None, shifts, current: 0, joins: Vec::new() }))
    }

    /// Corrects the times of the next packet of the stream.
    pub(crate) fn correct(&mut self, packet: &mut Packet) -> Result<()> {
        let number = self.n_packets;
        self.n_packets += 1;
        let time = packet.dts().or(packet.pts());
        if self.shifts.is_none() && self.last.zip(time).is_some_and(|(last, time)| is_jump(last, time)) {
            self.shifts = Some(read_shifts(&self.path, self.stream_idx)?);
        }
        self.last = time.or(self.last);
        let runs = self.shifts.as_deref().unwrap_or_default();
        let begun = runs.binary_search_by_key(&number, |run| run.first).ok().map(|nth| runs[nth]);
        if let Some(run) = begun {
            self.current = run.ticks;
        }
        let shifted = |time: Option<i64>| time.map(|time| time.saturating_add(self.current));
        let (pts, dts) = (shifted(packet.pts()), shifted(packet.dts()));
        packet.set_pts(pts);
        packet.set_dts(dts);
        self.joins.extend(begun.filter(|run| run.is_join).and(pts.or(dts)));
        Ok(())
    }

    /// Presentation times, in corrected ticks, at which another recording begins, as far as the stream has been read.
    pub(crate) fn joins(&self) -> &[i64] {
        &self.joins
    }
}

fn is_jump(last: i64, time: i64) -> bool {
    !(-MAX_BACK..=MAX_GAP).contains(&time.saturating_sub(last))
}

/// Consecutive packets of a stream on one clock.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ClockRun {
    /// Number of the first packet in its stream, and in the file.
    first: usize,
    position: usize,
    /// Decoding times of the start of the first packet and of the end of the last one, ticks.
    start: i64,
    end: i64,
}

/// Divides the packets of a stream into runs.
#[derive(Default)]
struct RunFinder {
    runs: Vec<ClockRun>,
    n_packets: usize,
    last: i64,
}

impl RunFinder {
    /// Adds the next packet, at `position` in the file, with its decoding time and its duration (0 if unknown).
    fn push(&mut self, position: usize, time: Option<i64>, duration: i64) {
        let first = self.n_packets;
        self.n_packets += 1;
        let Some(time) = time else { return };
        let last = std::mem::replace(&mut self.last, time);
        match self.runs.last_mut() {
            Some(run) if !is_jump(last, time) => {
                let duration = if duration > 0 { duration } else { (time - last).max(0) };
                run.end = time.saturating_add(duration);
            }
            _ => self.runs.push(ClockRun { first, position, start: time, end: time.saturating_add(duration.max(0)) }),
        }
    }
}

/// Reads the packets of `path` and returns the corrections of the runs of stream `stream_idx`.
fn read_shifts(path: &Path, stream_idx: usize) -> Result<Vec<RunShift>> {
    let mut input = source::open(path)?;
    let video_idx = source::video_stream(&input).map(|stream| stream.index());
    let (mut pictures, mut own) = (RunFinder::default(), RunFinder::default());
    for position in 0.. {
        let mut packet = Packet::empty();
        if packet.read(&mut input).is_err() || pictures.runs.len().max(own.runs.len()) > MAX_RUNS {
            break;
        }
        let (time, duration) = (packet.dts().or(packet.pts()), packet.duration());
        if packet.stream() == stream_idx {
            own.push(position, time, duration);
        }
        if Some(packet.stream()) == video_idx {
            pictures.push(position, time, duration);
        }
    }
    if pictures.runs.len().max(own.runs.len()) > MAX_RUNS {
        return Ok(Vec::new());
    }
    let mut ticks = Vec::new();
    for _ in &pictures.runs {
        ticks.push(next_shift(&pictures.runs, &ticks));
    }
    if video_idx != Some(stream_idx) {
        ticks = shifts_beside(&own.runs, &pictures.runs, &ticks);
    }
    Ok(run_shifts(&own.runs, &ticks))
}

/// Shift of the run that follows those with the given `shifts`: it starts where the previous run ends. After a few
/// damaged time stamps, the clock before them continues.
fn next_shift(runs: &[ClockRun], shifts: &[i64]) -> i64 {
    let (Some(run), [.., last_shift]) = (runs.get(shifts.len()), shifts) else { return 0 };
    let previous = runs[shifts.len() - 1];
    let end = previous.end.saturating_add(*last_shift);
    let is_glitch = previous.end.saturating_sub(previous.start) < MAX_GLITCH;
    let before = if let ([.., before, _], true) = (shifts, is_glitch) { Some(*before) } else { None };
    let continues = |shift: &i64| !is_jump(end, run.start.saturating_add(*shift));
    before.filter(continues).unwrap_or_else(|| end.saturating_sub(run.start))
}

/// Shifts of the runs of another stream: those of the pictures of the same recording. It is the recording in which the
/// run begins, or the next one, since packets are interleaved; of the two, the one that continues the stream.
fn shifts_beside(runs: &[ClockRun], pictures: &[ClockRun], picture_shifts: &[i64]) -> Vec<i64> {
    let mut shifts: Vec<i64> = Vec::with_capacity(runs.len());
    for (nth, run) in runs.iter().enumerate() {
        let next = pictures.partition_point(|picture| picture.position <= run.position);
        let near = next.saturating_sub(1)..pictures.len().min(next + 1);
        let is_on_clock = |picture: &ClockRun| {
            let range = picture.start.saturating_sub(MAX_GAP)..=picture.end.saturating_add(MAX_GAP);
            range.contains(&run.start)
        };
        let candidates = near.filter(|at| is_on_clock(&pictures[*at])).map(|at| picture_shifts[at]);
        let end = nth.checked_sub(1).map(|before| runs[before].end.saturating_add(shifts[before]));
        // The first of equal distances is chosen, and without an earlier run the first candidate.
        let distance = |shift: &i64| end.map_or(0, |end| run.start.saturating_add(*shift).saturating_sub(end).abs());
        let shift = candidates.min_by_key(distance).unwrap_or_else(|| next_shift(runs, &shifts));
        shifts.push(shift);
    }
    shifts
}

/// Corrections of runs; the two ends of a run of damaged time stamps are no joins.
fn run_shifts(runs: &[ClockRun], ticks: &[i64]) -> Vec<RunShift> {
    let shift = |nth: Option<usize>| nth.and_then(|nth| ticks.get(nth)).copied();
    let join = |nth: usize| {
        let [before, previous, next] = [nth.checked_sub(2), nth.checked_sub(1), nth.checked_add(1)].map(shift);
        let own = Some(ticks[nth]);
        nth > 0 && own != previous && own != before && next != previous
    };
    let all = runs.iter().zip(ticks).enumerate();
    all.map(|(nth, (run, ticks))| RunShift { first: run.first, ticks: *ticks, is_join: join(nth) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(secs: f64) -> i64 {
        (secs * 90_000.0).round() as i64
    }

    /// Runs of a stream that starts at these seconds and lasts so long, with 25 packets per second.
    fn runs(spans: &[(f64, f64)]) -> Vec<ClockRun> {
        let mut finder = RunFinder::default();
        for (start, secs) in spans {
            for n in 0..(25.0 * secs).round() as i64 {
                let position = 2 * finder.n_packets;
                finder.push(position, Some(ticks(*start) + 3600 * n), 3600);
            }
        }
        finder.runs
    }

    fn shifts(runs: &[ClockRun]) -> Vec<i64> {
        let mut shifts = Vec::new();
        runs.iter().for_each(|_| shifts.push(next_shift(runs, &shifts)));
        shifts
    }

    #[test]
    fn runs_continue_at_jumps_in_both_directions() {
        let joined = runs(&[(1.4, 3.0), (1.4, 5.0), (40_000.0, 2.0), (7.0, 0.5)]);
        let ms: Vec<i64> = shifts(&joined).iter().map(|shift| shift / 90).collect();
        assert_eq!(ms, [0, 3000, 9_400 - 40_000_000, 11_400 - 7000]);
        let corrected = run_shifts(&joined, &shifts(&joined));
        assert_eq!(
            corrected.iter().map(|run| (run.first, run.is_join)).collect::<Vec<_>>(),
            [(0, false), (75, true), (200, true), (250, true)]
        );
        // A gap of up to 10 s remains a gap.
        assert_eq!(runs(&[(0.0, 1.0), (10.0, 1.0)]).len(), 1);
        assert_eq!(runs(&[(0.0, 1.0), (12.0, 1.0)]).len(), 2);
    }

    #[test]
    fn the_clock_continues_after_damaged_time_stamps() {
        let damaged = runs(&[(0.0, 2.0), (9000.0, 0.04), (2.2, 3.0)]);
        let found = shifts(&damaged);
        assert_eq!((found[0], found[2]), (0, 0));
        assert!(run_shifts(&damaged, &found).iter().all(|run| !run.is_join));
        assert!(shifts(&[]).is_empty());
    }

    #[test]
    fn sound_is_shifted_by_the_time_of_its_pictures() {
        let pictures = runs(&[(1.4, 3.0), (1.4, 3.0), (1.4, 3.0)]);
        let expected = shifts(&pictures);
        let at = |position: usize, start: f64, end: f64| {
            let [start, end] = [start, end].map(ticks);
            ClockRun { first: 0, position, start, end }
        };
        // Interleaved a little earlier or later than the pictures, and a little shorter or longer.
        let sound = [at(1, 1.38, 4.41), at(147, 1.38, 4.3), at(305, 1.45, 4.4)];
        assert_eq!(shifts_beside(&sound, &pictures, &expected), expected);
        // The first recording has no sound.
        assert_eq!(shifts_beside(&sound[2..], &pictures, &expected), expected[2..]);
        // Damaged times of the sound alone, and sound without pictures.
        let sound = [at(1, 1.4, 2.4), at(51, 800.0, 800.1), at(55, 2.5, 4.4)];
        assert_eq!(shifts_beside(&sound, &pictures, &expected)[2], 0);
        assert_eq!(shifts_beside(&sound[..2], &[], &[])[1], ticks(2.4 - 800.0));
    }
}
