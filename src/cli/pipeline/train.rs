//! `orator run --train`: trains a model per speaker on its dataset, evaluates it on a held-out part, and writes a film
//! and a page with the results.

use crate::cli::evaluate::speakers::{SpeakerFolders, measure};
use crate::cli::train::gan::train_speaker;
use crate::cli::train::training::{TrainedModel, TrainedModels, train_all};
use crate::cli::ui::Ui;
use anyhow::{Context as _, Result};
use ndarray::s;
use orator_avatar::animate::export::film::{self, FilmSource, SecondPanel, smooth_rate};
use orator_avatar::animate::export::film_avatar::FilmCamera;
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{SAMPLE_RATE, Sound};
use orator_dataset::{Dataset, Split};
use orator_gesture::evaluate::clips::clips::EvalClips;
use orator_gesture::evaluate::clips::motion_store::StoredMotion;
use orator_gesture::evaluate::conclusion::conclusion::{better_than_constant_pose, depends_on_audio};
use orator_gesture::generate::model::model_lock;
use orator_gesture::metrics::settings::MetricSettings;
use orator_pipeline::stale_results::OLD_MODEL;
use orator_pipeline::{Pipeline, UnitState};
use orator_report::evaluation::page;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Maximum duration of the film, seconds.
const MAX_FILM_SECS: f64 = 20.0;

/// Trains, evaluates and shows the models of the speakers with these dataset folders.
///
/// # Errors
/// The status of the models cannot be determined; failures of a speaker are part of the results.
pub(super) fn train_speakers(pipeline: &Pipeline, datasets: &[PathBuf], ui: &Ui) -> Result<TrainedModels> {
    let mut config = pipeline.config().clone();
    let has_dataset = |name: &str| datasets.iter().any(|dir| dir.file_name().is_some_and(|of| of == name));
    config.settings.speaker.retain(|speaker| has_dataset(&speaker.name));
    let stale: Vec<String> = pipeline
        .status(&[])?
        .models
        .into_iter()
        .filter_map(|model| (model.state == UnitState::Stale).then_some(model.name))
        .collect();
    train_all(&config, ui, |speaker| {
        let folders = SpeakerFolders::new(&config.settings.work.dir, speaker);
        if stale.contains(&format!("gan/{speaker}")) {
            move_aside(&folders.model)?;
        }
        with_results(train_speaker(&config, speaker, ui)?, &folders, ui)
    })
}

/// Moves a stale model beside itself, where it replaces an earlier one.
fn move_aside(model: &Path) -> Result<()> {
    let _model = FolderLock::exclusive(model)?;
    // Fails while another process trains the model.
    drop(workdir::lock(model)?);
    let mut name = model.file_name().unwrap_or_default().to_os_string();
    name.push(OLD_MODEL);
    workdir::replace_folder(model, &model.with_file_name(name))
}

/// Adds the evaluation to the result of a training. If the model cannot be evaluated, it remains and the reason is
/// reported.
fn with_results(model: TrainedModel, folders: &SpeakerFolders, ui: &Ui) -> Result<TrainedModel> {
    let TrainedModel { mut text, mut next, mut facts, has_page } = model;
    let evaluated = evaluate(folders, ui);
    match &evaluated {
        Ok(results) => {
            text += &format!("\n{}\n{}\npage  {}", results.verdicts[0], results.verdicts[1], results.page.display());
            next = format!("xdg-open {}", results.page.display());
            facts["split"] = json!(results.split.name());
            facts["conclusions"] = json!(results.verdicts);
            facts["report"] = json!(results.page);
            facts["film"] = json!(results.film);
            facts["next"] = json!(next);
        }
        Err(error) => {
            text += &format!("\nnot evaluated: {error:#}");
            facts["error"] = json!(format!("{error:#}"));
        }
    }
    Ok(TrainedModel { text, next, facts, has_page: has_page && evaluated.is_ok() })
}

/// Files and conclusions of an evaluation.
struct ModelResults {
    split: Split,
    /// Whether the model is better than a constant pose, and whether its motion depends on the audio.
    verdicts: [String; 2],
    page: PathBuf,
    film: PathBuf,
}

/// Evaluates a model on the test split, else on the validation split, else on the training split, which the page
/// states; writes `film.mp4` and `result.html` into the folder of the model.
fn evaluate(folders: &SpeakerFolders, ui: &Ui) -> Result<ModelResults> {
    let _dataset = FolderLock::shared(&folders.dataset)?;
    let _model = model_lock(&folders.model)?;
    let dataset = Dataset::open(&folders.dataset)?;
    let has_samples = |split: &Split| !dataset.samples(*split).is_empty();
    let split = [Split::Test, Split::Validation].into_iter().find(has_samples).unwrap_or(Split::Train);
    let (evaluation, table) = measure(folders, split, &MetricSettings::default(), ui)?;
    let own = table.predictions().next().context("the evaluation has no prediction")?;
    let verdicts = [better_than_constant_pose(&table, own).sentence, depends_on_audio(&table, own).sentence];
    let film = folders.model.join("film.mp4");
    write_film(&film, &evaluation.clips, ui)?;
    let bytes = std::fs::read(&film).with_context(|| format!("cannot read {}", film.display()))?;
    let title = format!("{}: {} split", folders.name, split.name());
    let html = page::html(&table, &evaluation.clips, &title, Some(&bytes))?;
    let page = folders.model.join("result.html");
    workdir::write_file(&page, html.as_bytes())?;
    Ok(ModelResults { split, verdicts, page, film })
}

/// Writes the generated motion of the longest clip beside the true one.
fn write_film(path: &Path, clips: &EvalClips, ui: &Ui) -> Result<()> {
    let clip = clips.clips.iter().max_by_key(|clip| clip.n_frames()).context("the evaluation has no clip")?;
    let n_frames = clip.n_frames().min((MAX_FILM_SECS * clips.fps.per_sec()) as usize);
    let options = AnimationOptions { fps: Some(smooth_rate(clips.fps)), ..AnimationOptions::default() };
    let animated = |joints: &StoredMotion| {
        let joints = joints.view().slice(s![..n_frames, ..N_JOINTS, ..]).to_owned();
        perform(&Motion::from_joints(clips.fps, joints), None, &options)
    };
    let (generated, truth) = (animated(&clip.predicted), animated(&clip.ground_truth));
    let samples = clip.audio.as_ref().map(|audio| audio.samples(0.0, clips.fps.secs(n_frames))).transpose()?;
    let sound = samples.map(|samples| Sound {
        rate: SAMPLE_RATE,
        samples: samples.into_iter().map(|sample| f32::from(sample) / 32_768.0).collect(),
    });
    let content = FilmSource {
        performance: &generated,
        camera: FilmCamera::Front,
        sound: sound.as_ref(),
        second_panel: SecondPanel::Motion { performance: &truth, labels: ["generated", "truth"] },
    };
    workdir::replace(path, |attempt| film::write(attempt, content, ui))
}
