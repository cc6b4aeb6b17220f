//! How long workers take for videos together: a simulation of the order in which the runner gives out work.

/// Work on one video, seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VideoWork {
    /// Before the spans that workers share; all of it where there are none.
    pub before: f64,
    /// On each span.
    pub span: f64,
    /// How many of them; 0: workers share nothing of it.
    pub n_spans: usize,
    /// After the last span.
    pub after: f64,
}

/// A video that a worker has begun.
struct BegunVideo {
    work: VideoWork,
    /// When its spans can be taken.
    since: f64,
    /// Spans that nobody has taken.
    n_left: usize,
    /// When the last one taken is done.
    ends: f64,
}

impl BegunVideo {
    /// A worker that is free at `now` takes a span; when it is done.
    fn take(&mut self, now: f64) -> f64 {
        self.n_left -= 1;
        let done = now + self.work.span;
        self.ends = self.ends.max(done);
        done
    }
}

/// Seconds until `workers` have worked on all videos. Whoever is free takes the next video and its spans; where no video is
/// left, spans of others.
pub fn wall_secs(videos: &[VideoWork], workers: usize) -> f64 {
    let n_pieces: usize = videos.iter().map(|video| video.n_spans.max(1)).sum();
    let mut waiting = videos.iter();
    let mut begun: Vec<BegunVideo> = Vec::new();
    // When each worker is free, and the video that it has.
    let mut crew: Vec<(f64, Option<usize>)> = vec![(0.0, None); workers.clamp(1, n_pieces.max(1))];
    let mut wall = 0.0f64;
    while let Some(at) = (0..crew.len()).min_by(|a, b| crew[*a].0.total_cmp(&crew[*b].0)) {
        let (now, own) = crew[at];
        if let Some(idx) = own {
            let video = &mut begun[idx];
            if video.n_left > 0 {
                crew[at].0 = video.take(now);
            } else {
                let done = video.ends + video.work.after;
                wall = wall.max(done);
                crew[at] = (done, None);
            }
        } else if let Some(&work) = waiting.next() {
            let since = now + work.before;
            begun.push(BegunVideo { work, since, n_left: work.n_spans, ends: since });
            crew[at] = (since, Some(begun.len() - 1));
        } else if let Some(video) = begun.iter_mut().find(|video| video.n_left > 0 && video.since <= now) {
            crew[at].0 = video.take(now);
        } else if let Some(later) =
            begun.iter().filter(|video| video.n_left > 0).map(|video| video.since).min_by(f64::total_cmp)
        {
            crew[at].0 = later;
        } else {
            crew.swap_remove(at);
        }
    }
    wall
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONG: VideoWork = VideoWork { before: 10.0, span: 100.0, n_spans: 3, after: 20.0 };
    const SHORT: VideoWork = VideoWork { before: 40.0, span: 0.0, n_spans: 0, after: 0.0 };

    #[test]
    fn one_worker_takes_the_sum() {
        assert_eq!(wall_secs(&[], 1), 0.0);
        assert_eq!(wall_secs(&[LONG, SHORT, SHORT], 1), 330.0 + 80.0);
    }

    #[test]
    fn spans_wait_for_what_is_before_and_the_rest_for_the_last_span() {
        // 10, then spans 10..110 twice and 110..210, then 20 more.
        assert_eq!(wall_secs(&[LONG], 2), 230.0);
        assert_eq!(wall_secs(&[LONG], 3), 130.0);
        assert_eq!(wall_secs(&[LONG], 99), 130.0);
    }

    #[test]
    fn who_has_no_video_helps() {
        // The second worker has SHORT until 40 and a span until 140; the first spans until 110 and 210.
        assert_eq!(wall_secs(&[LONG, SHORT], 2), 230.0);
        // Two short ones until 80, a span until 180.
        assert_eq!(wall_secs(&[LONG, SHORT, SHORT], 2), 230.0);
        // Four until 160, and the third span until 260; the first is done with the second at 210.
        assert_eq!(wall_secs(&[LONG, SHORT, SHORT, SHORT, SHORT], 2), 280.0);
    }
}
