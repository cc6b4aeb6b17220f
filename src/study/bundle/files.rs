//! Static files of a study: the page with its texts, sessions made before under opaque names, and the films.

use super::address::origin;
use crate::file::StudyFile;
use crate::folder::StudyFolder;
use crate::pages::assets::{ASSETS, PARTICIPANT_PAGE};
use crate::pages::page_texts::page_texts;
use crate::plan::{StudyPlan, Trial};
use anyhow::{Context, Result, ensure};
use orator_base::stage::workdir;
use serde_json::json;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// What is written beside the files to upload.
const README: &str = include_str!("readme.md");

/// Plan of a study with the names that its sessions have in a bundle.
#[derive(Clone, Debug)]
pub struct BundledPlan {
    pub plan: StudyPlan,
    /// Name of the study in what is sent, 16 hexadecimal digits of the plan's hash.
    pub study: String,
    /// Opaque names of the sessions, in the plan's order.
    pub sessions: Vec<String>,
}

impl BundledPlan {
    /// Reads the plan of `folder`.
    ///
    /// # Errors
    /// No plan, or one that names what is not there.
    pub fn read(folder: &StudyFolder) -> Result<Self> {
        let path = folder.plan();
        let bytes = fs::read(&path)
            .with_context(|| format!("cannot read {}; `orator study build` makes it", path.display()))?;
        let plan: StudyPlan =
            serde_json::from_slice(&bytes).with_context(|| format!("{} is not a study's plan", path.display()))?;
        let trials = || plan.sessions.iter().flat_map(|session| &session.trials);
        ensure!(trials().all(|trial| trial.task < plan.tasks.len()), "{}: a trial without a task", path.display());
        let is_opaque = |name: &String| name.len() == 16 && name.bytes().all(|b| b.is_ascii_hexdigit());
        ensure!(
            trials().flat_map(|trial| &trial.films).all(is_opaque),
            "{}: a film's name is not opaque",
            path.display()
        );
        // The plan is not among the files: who does not have it can foretell no name.
        let name = |index: usize| {
            let hash = blake3::derive_key(
                "orator 2026 names of bundled sessions",
                &[&bytes[..], &index.to_le_bytes()].concat(),
            );
            blake3::Hash::from_bytes(hash).to_hex()[..16].to_owned()
        };
        let sessions = (0..plan.sessions.len()).map(name).collect();
        Ok(Self { study: blake3::hash(&bytes).to_hex()[..16].to_owned(), sessions, plan })
    }
}

/// Writes static files of the study in `folder` into the new folder `out`; the page sends to the address `post`.
///
/// # Errors
/// A study that is not built, an address that is none, `out` with files in it.
pub fn write(folder: &StudyFolder, post: &str, out: &Path) -> Result<BundledPlan> {
    let origin = origin(post)?;
    ensure!(!workdir::has_files(out), "{} has files in it already; name another folder by --out", out.display());
    let bundled = BundledPlan::read(folder)?;
    let file = StudyFile::read(&folder.study_file())?;
    workdir::build_folder(out, |attempt| {
        let public = attempt.join("public");
        for (path, _, text) in ASSETS {
            match path {
                "/" => fs::create_dir_all(&public)
                    .and_then(|()| fs::write(public.join("index.html"), page(post, origin)))?,
                "/operator" | "/operator.js" => {}
                _ => fs::write(public.join(path.trim_start_matches('/')), text)?,
            }
        }
        let about = about(&bundled, &file);
        for name in ["api", "sessions", "films"] {
            fs::create_dir(public.join(name))?;
        }
        fs::write(public.join("api/study.json"), serde_json::to_vec(&about)?)?;
        for (name, session) in bundled.sessions.iter().zip(&bundled.plan.sessions) {
            let trials: Vec<_> = session.trials.iter().map(shown).collect();
            let text = serde_json::to_vec(&json!({ "trials": trials }))?;
            fs::write(public.join("sessions").join(format!("{name}.json")), text)?;
        }
        for film in films(&bundled.plan) {
            let (from, to) = (folder.film(film), public.join("films").join(format!("{film}.mp4")));
            fs::copy(&from, to).with_context(|| format!("cannot copy the film {}", from.display()))?;
        }
        let places = (1..=bundled.sessions.len()).map(|place| format!("{place},?place={place}\n"));
        fs::write(attempt.join("places.csv"), format!("place,address\n{}", places.collect::<String>()))?;
        fs::write(attempt.join("README.md"), README.replace("{post}", post))?;
        Ok(())
    })?;
    Ok(bundled)
}

/// The participants' page, which sends to `post`. A host of files sets no headers: the policy stands in the page.
fn page(post: &str, origin: &str) -> String {
    let policy = format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; media-src 'self'; connect-src 'self' {origin}; \
         img-src 'self' data:; base-uri 'none'; form-action 'none'"
    );
    let meta = format!("<meta charset=\"utf-8\">\n<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">");
    let address = post.replace('&', "&amp;");
    let page = PARTICIPANT_PAGE.replace("<meta charset=\"utf-8\">", &meta);
    page.replace("<html lang=\"en\"", &format!("<html lang=\"en\" data-collector=\"{address}\""))
}

/// What the page reads first.
fn about(bundled: &BundledPlan, file: &StudyFile) -> serde_json::Value {
    let BundledPlan { plan, study, sessions } = bundled;
    json!({
        "study": study,
        "title": file.title,
        "languages": file.languages,
        "texts": page_texts(&file.languages, &file.texts),
        "tasks": plan.tasks,
        "n_trials": plan.sessions.first().map_or(0, |session| session.trials.len()),
        "sound_check": plan.sound_check,
        "return_url": file.return_url,
        "sessions": sessions,
    })
}

/// Trial without the right response.
fn shown(trial: &Trial) -> serde_json::Value {
    json!({ "task": trial.task, "phase": trial.phase, "films": trial.films })
}

fn films(plan: &StudyPlan) -> BTreeSet<&String> {
    let trials = plan.sessions.iter().flat_map(|session| &session.trials);
    let check = Some(&plan.sound_check).filter(|film| !film.is_empty());
    trials.flat_map(|trial| &trial.films).chain(check).collect()
}
