//! The pages of the guide as text.

/// A page of the guide.
#[derive(Clone, Copy, Debug)]
pub struct Topic {
    /// Word by which `orator guide` finds the page.
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
pub const TOPICS: [Topic; 14] = [
    topic!("dataset", "files of a dataset, refused seconds, transcripts, splits, import and removal"),
    topic!("lifting", "2D keypoints to 3D joints: input, output, errors, a lifter of your own"),
    topic!("keypoints", "keypoints of OpenPose, MMPose, AlphaPose, MediaPipe and PATS in place of videos"),
    topic!("training", "training: settings, recipes, fine-tuning, validation, checkpoints; speech to motion"),
    topic!("animation", "joints to BVH, GLB, JSON and MP4: rig, smoothing, constraints"),
    topic!("evaluation", "metrics, baselines, conclusions, conventions, comparison of results, rendered people"),
    topic!("results", "measured results of detectors, recipes and fine-tuning; speed; the commands that print them"),
    topic!("study", "user studies: the study file, clips and films, the page, the answers and what they say"),
    topic!("models", "the pose models: origin, licences, fetching, adding one"),
    topic!("configuration", "pipeline.toml, --set, the work folder, exit codes, JSON output"),
    topic!("cluster", "many machines on one work folder: plan, workers, Slurm, Kubernetes, ssh"),
    topic!("security", "what is trusted: the sandbox of videos, files, network, forgetting, locks"),
    topic!("architecture", "the crates of the workspace, and the way of a frame through them"),
    topic!("contributing", "building, tests, real data, rules of the source"),
];

#[cfg(test)]
mod tests {
    use super::TOPICS;

    #[test]
    fn every_page_has_one_title_and_no_line_too_wide_for_a_terminal() {
        for topic in TOPICS {
            let titles = topic.text.lines().filter(|line| line.starts_with("# ")).count();
            assert!(topic.text.starts_with("# ") && titles >= 1, "{} has no title", topic.name);
            let wide = topic.text.lines().find(|line| line.chars().count() > 120 && !line.starts_with('|'));
            assert_eq!(wide, None, "{}", topic.name);
        }
    }
}
