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
use orator_nn::device::Device;
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
/// A training that was stopped on request; failures of a speaker are part of the results.
pub(super) fn train_speakers(
    pipeline: &Pipeline,
    datasets: &[PathBuf],
    device: &Device,
    ui: &Ui,
) -> Result<TrainedModels> {
    let mut config = pipeline.config().clone();
    let has_dataset = |name: &str| datasets.iter().any(|dir| dir.file_name().is_some_and(|of| of == name));
    config.settings.speaker.retain(|speaker| has_dataset(&speaker.name));
    train_all(&config, ui, |speaker| {
        let folders = SpeakerFolders::new(&config.settings.work.dir, speaker);
        // Determined here, since another process may have trained the model during the training of other speakers.
        let models = pipeline.status(std::slice::from_ref(speaker))?.models;
        if models.iter().any(|model| model.name == format!("gan/{speaker}") && model.state == UnitState::Stale) {
            move_aside(&folders.model)?;
        }
        with_results(train_speaker(&config, speaker, device, ui)?, &folders, device, ui)
    })
}

/// Moves a stale model beside itself, where it replaces an earlier one. The earlier one is removed first: an exchange
/// that is killed would leave it in the place of the model.
fn move_aside(model: &Path) -> Result<()> {
    let mut name = model.file_name().unwrap_or_default().to_os_string();
    name.push(OLD_MODEL);
    let old = model.with_file_name(name);
    // Fails while another process trains or reads one of the models.
    let _locks = [FolderLock::exclusive(model)?, FolderLock::exclusive(&old)?];
    drop(workdir::lock(model)?);
    workdir::remove(&old)
        .and_then(|()| std::fs::rename(model, &old))
        .with_context(|| format!("cannot move {} to {}", model.display(), old.display()))
}

/// Adds the evaluation to the result of a training. If the model cannot be evaluated, it remains and the reason is
/// reported.
fn with_results(model: TrainedModel, folders: &SpeakerFolders, device: &Device, ui: &Ui) -> Result<TrainedModel> {
    let TrainedModel { mut text, mut next, mut facts, has_page } = model;
    let evaluated = evaluate(folders, device, ui);
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
fn evaluate(folders: &SpeakerFolders, device: &Device, ui: &Ui) -> Result<ModelResults> {
    let _dataset = FolderLock::shared(&folders.dataset)?;
    let _model = model_lock(&folders.model)?;
    let dataset = Dataset::open(&folders.dataset)?;
    let has_samples = |split: &Split| !dataset.samples(*split).is_empty();
    let split = [Split::Test, Split::Validation].into_iter().find(has_samples).unwrap_or(Split::Train);
    let (evaluation, table) = measure(folders, split, &MetricSettings::default(), device, ui)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stale_model_replaces_the_one_that_was_moved_before() {
        let dir = tempfile::tempdir().unwrap();
        let [model, old] = ["host", "host-old"].map(|name| dir.path().join(name));
        for text in ["first", "second"] {
            std::fs::create_dir(&model).unwrap();
            std::fs::write(model.join("best.safetensors"), text).unwrap();
            move_aside(&model).unwrap();
            assert!(!model.exists());
            assert_eq!(std::fs::read_to_string(old.join("best.safetensors")).unwrap(), text);
        }
        std::fs::create_dir(&model).unwrap();
        let _training = FolderLock::shared(&model).unwrap();
        assert!(move_aside(&model).is_err() && model.exists() && old.exists());
    }
}
