//! The pages of the guide as text.

/// A page of the guide.
#[derive(Clone, Copy, Debug)]
pub struct Topic {
    /// Name of the page for `orator guide`.
    pub name: &'static str,
    /// Contents of the page in one line.
    pub summary: &'static str,
    /// The page, in Markdown.
    pub text: &'static str,
}

macro_rules! topic {
    ($name:literal, $summary:literal) => {
        Topic { name: $name, summary: $summary, text: include_str!(concat!($name, ".md")) }
    };
}

/// Every page, in reading order.
pub const TOPICS: [Topic; 21] = [
    topic!("tutorial", "from videos to generated motion: every command with its output"),
    topic!("questions", "minutes of video, own rig, own language, phone videos, seated speakers"),
    topic!("dataset", "files of a dataset, rejected seconds, transcripts, splits, import and removal"),
    topic!("view", "a local page: videos with keypoints and avatar, decisions, trainings, results"),
    topic!("lifting", "2D keypoints to 3D joints: input, output, errors, custom lifters"),
    topic!("keypoints", "keypoints of OpenPose, MMPose, AlphaPose, MediaPipe and PATS instead of videos"),
    topic!("training", "training: settings, recipes, fine-tuning, validation, checkpoints; generating motion"),
    topic!("live", "gestures while you speak: microphones, VSeeFace and other programs, a page, voice agents"),
    topic!("onnx", "trained models in Python, browsers and Unity: files, example programs"),
    topic!("gpu", "training and generation on an NVIDIA GPU: building, libraries, measurements"),
    topic!("animation", "joints to BVH, GLB, JSON and MP4: rig, smoothing, constraints"),
    topic!("evaluation", "metrics, baselines, conclusions, conventions, comparison of results, rendered persons"),
    topic!("results", "measured results of detectors, recipes and fine-tuning; speed; the commands that print them"),
    topic!("papers", "every statement of both papers: code, settings, defaults, measurements; paper against code"),
    topic!("study", "user studies: the study file, clips and films, the web page, the answers and their analysis"),
    topic!("models", "pose models: origin, licences, download, adding your own"),
    topic!("configuration", "pipeline.toml, --set, the work folder, exit codes, JSON output"),
    topic!("cluster", "several machines that share a work folder: plan, workers, Slurm, Kubernetes, SSH"),
    topic!("security", "threat model: sandboxed video decoding, files, network, removal of data, locks"),
    topic!("architecture", "crates of the workspace, and the data flow between them"),
    topic!("contributing", "building, tests, real data, rules of the source code"),
];

#[cfg(test)]
mod tests {
    use super::TOPICS;

    #[test]
    fn every_page_has_one_title_and_no_line_too_wide_for_a_terminal_and_the_guide_is_short() {
        for topic in TOPICS {
            let titles = topic.text.lines().filter(|line| line.starts_with("# ")).count();
            assert!(topic.text.starts_with("# ") && titles >= 1, "{} has no title", topic.name);
            let wide = topic.text.lines().find(|line| line.chars().count() > 120 && !line.starts_with('|'));
            assert_eq!(wide, None, "{}", topic.name);
        }
        let n_lines: usize = TOPICS.iter().map(|topic| topic.text.lines().count()).sum();
        assert!(n_lines <= 2140, "{n_lines} lines");
    }
}
