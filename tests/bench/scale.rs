//! `cargo bench -- scale`.

use super::child::{Child, measure};
use super::report::Report;
use anyhow::{Context, Result, ensure};
use orator_base::stage::artifacts::{self, Artifact};
use orator_base::stage::fingerprint::{Fingerprint, HashCache};
use orator_base::stage::progress::{Progress, Silent};
use orator_base::stage::record::{Output, Record};
use orator_base::stage::{Stage, Unit};
use orator_base::types::sound::{SAMPLE_RATE, Sound};
use orator_dataset::config;
use orator_formats::wav;
use orator_pipeline::extract::ExtractStage;
use orator_pipeline::pose2d::Pose2dStage;
use orator_test_support::drawn::folder;
use orator_test_support::drawn::folder::DemoPlan;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};

/// Growth of time and memory of the commands that process all videos with the hours of video. A synthetic work folder
/// has one video per ten minutes, with the records and files of `extract` and `pose2d`; their arrays are those of a
/// six-second clip, with different audio. Each command runs as a separate process.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Hours of video, two numbers.
    #[arg(long, num_args = 2, default_values_t = [10, 100], value_name = "HOURS")]
    hours: Vec<usize>,
    /// A folder with some gigabytes of free space; a temporary folder is created in it.
    #[arg(long, default_value = ".", value_name = "DIR")]
    dir: PathBuf,
}

const CLIP_SECS: f64 = 6.0;
const VIDEOS_AN_HOUR: usize = 6;

/// Measured commands, in an order in which each has its inputs.
const COMMANDS: [(&str, &[&str]); 10] = [
    ("segment", &["run", "--only", "segment"]),
    ("lift", &["run", "--only", "lift"]),
    ("dataset", &["run", "--only", "dataset"]),
    ("segment again", &["run", "--only", "segment", "--force"]),
    ("run, all fresh", &["run"]),
    ("status", &["status", "--why"]),
    ("verify", &["dataset", "verify", "work/dataset/host"]),
    ("verify --deep", &["dataset", "verify", "--deep", "work/dataset/host"]),
    ("report", &["report", "--pictures", "0"]),
    ("forget", &["forget", "--video", "talk-00000.mp4"]),
];

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    let (few, many) = (args.hours[0], args.hours[1]);
    ensure!(few > 0 && many > few, "--hours takes two numbers, the second one larger, not {few} and {many}");
    let root = std::path::absolute(args.dir.join(format!("bench-{}", std::process::id())))?;
    let measured = measure_both(&root, few, many, progress);
    fs::remove_dir_all(&root).with_context(|| format!("removing {}", root.display()))?;
    let measured = measured?;

    let head = [format!("{few} h"), format!("{many} h")];
    let mut lines = vec![format!("{:15} {:>10} {:>10}   processor an hour   peak memory", "", head[0], head[1])];
    let mut facts = serde_json::Map::new();
    for ((name, _), [of_few, of_many]) in COMMANDS.iter().zip(&measured) {
        // Processor time, because wall time depends on other load of the machine.
        let per_hour = (of_many.cpu_secs / many as f64) / (of_few.cpu_secs / few as f64);
        lines.push(format!(
            "{name:15} {:8.2} s {:8.2} s {per_hour:11.2} times   {:.0} MiB, then {:.0} MiB",
            of_few.secs, of_many.secs, of_few.peak_mib, of_many.peak_mib
        ));
        facts.insert(
            (*name).to_owned(),
            json!({
                "secs": [of_few.secs, of_many.secs], "cpu_secs": [of_few.cpu_secs, of_many.cpu_secs],
                "peak_mib": [of_few.peak_mib, of_many.peak_mib], "cpu_an_hour_ratio": per_hour,
            }),
        );
    }
    Ok(Report { text: lines.join("\n"), facts: json!({ "hours": [few, many], "verbs": facts }) })
}

/// Measures all `COMMANDS` for both numbers of hours.
fn measure_both(root: &Path, few: usize, many: usize, progress: &dyn Progress) -> Result<Vec<[Child; 2]>> {
    let clip = root.join("clip");
    let plan = DemoPlan { n_videos: 1, secs: CLIP_SECS, ..DemoPlan::default() };
    folder::draw(&clip, &plan, &Silent)?;
    measure(&clip, &["run", "--to", "pose2d"])?;
    let task = progress.begin("scale", 2 * COMMANDS.len() as u64);
    let of_hours = |hours: usize| -> Result<Vec<Child>> {
        let dir = root.join(format!("{hours}-hours"));
        task.detail(&format!("{hours} h"));
        create_project(&clip, &dir, hours * VIDEOS_AN_HOUR)?;
        let children = COMMANDS.iter().map(|(_, args)| {
            task.advance(1);
            measure(&dir, args)
        });
        children.collect()
    };
    let (of_few, of_many) = (of_hours(few)?, of_hours(many)?);
    Ok(of_few.into_iter().zip(of_many).map(|(few, many)| [few, many]).collect())
}

/// Creates a project folder of `n_videos` with completed `extract` and `pose2d`, copied from the one video of
/// `template`.
fn create_project(template: &Path, dir: &Path, n_videos: usize) -> Result<()> {
    let videos = dir.join("videos/host");
    fs::create_dir_all(&videos)?;
    copy_all(&template.join("models"), &dir.join("models"))?;
    fs::copy(template.join("pipeline.toml"), dir.join("pipeline.toml"))?;
    for n in 0..n_videos {
        fs::write(videos.join(format!("talk-{n:05}.mp4")), format!("stands for video {n}"))?;
    }
    let units = |dir: &Path| -> Result<(config::Config, Vec<Unit>)> {
        let config = config::load(&dir.join("pipeline.toml"), &[])?;
        let units = config::videos::all(&config).into_iter().flat_map(|videos| videos.units).collect();
        Ok((config, units))
    };
    let (template_units, (config, units)) = (units(template)?.1, units(dir)?);
    let [video] = &template_units[..] else { anyhow::bail!("the template has {} videos", template_units.len()) };
    let hashes = HashCache::open(&artifacts::hashes(&config.settings.work.dir));
    let extract = ExtractStage::new(&config.settings.extract);
    let pose2d = Pose2dStage::new(&config.settings)?;
    let stages: [(&dyn Stage, bool); 2] = [(&extract, true), (&pose2d, false)];
    for (stage, writes_sound) in stages {
        let from = video.dir(&template.join("work").join(stage.name()));
        let record = Record::read(&from).with_context(|| format!("{} was not written", from.display()))?;
        for (n, unit) in units.iter().enumerate() {
            let to = unit.dir(&config.settings.work.dir.join(stage.name()));
            copy_all(&from, &to)?;
            if writes_sound {
                wav::write(&Artifact::Sound.within(&to), &noise(n as u64))?;
            }
            let fingerprint = Fingerprint::now(stage, unit, &hashes)?;
            Record { fingerprint, outputs: Output::list(&to)?, ..record.clone() }.write(&to)?;
        }
    }
    hashes.save()
}

/// Noise that is unique to a video.
fn noise(seed: u64) -> Sound {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let n = (CLIP_SECS * f64::from(SAMPLE_RATE)) as usize;
    Sound { rate: SAMPLE_RATE, samples: (0..n).map(|_| rng.random_range(-0.3f32..0.3)).collect() }
}

fn copy_all(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from).with_context(|| format!("reading {}", from.display()))? {
        let path = entry?.path();
        fs::copy(&path, to.join(path.file_name().unwrap_or_default()))?;
    }
    Ok(())
}
