//! Published packages: downloaded with the user's own `npm` or `pip`, so that configured mirrors and proxies apply,
//! and read without executing any of their code.

use super::fetch::MAX_BYTES;
use super::{ModelSource, SourceKind};
use anyhow::{Context, Result, anyhow, bail, ensure};
use orator_base::foreign_program::command_in;
use orator_base::input;
use std::collections::BTreeMap;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::Stdio;

/// Downloads the file of the package `source` into the empty folder `dir`, in which `npm` or `pip` runs, and returns
/// its path. Its hash is not yet checked. Errors: `npm` or `pip` is missing or fails.
pub(crate) fn download(source: &ModelSource, dir: &Path) -> Result<PathBuf> {
    let destination = dir.join("package");
    let folder = destination.to_str().with_context(|| format!("the folder name {} is not UTF-8", dir.display()))?;
    let cannot_create = || format!("cannot create the folder {folder}");
    std::fs::create_dir(&destination).with_context(cannot_create)?;
    match source.from {
        SourceKind::Npm => {
            // The `.npmrc` of a project selects the registry and can send environment variables to it. npm searches
            // the parent folders for a project, and above it for a workspace, so this folder, which has no `.npmrc`,
            // is made a project. `--prefix` would disable the system's own configuration.
            std::fs::write(dir.join("package.json"), "{}\n").with_context(cannot_create)?;
            let arguments = [
                "pack",
                &source.name,
                "--pack-destination",
                folder,
                "--ignore-scripts",
                "--workspaces=false",
                "--silent",
                "--fetch-retries=1",
            ];
            run(dir, &[&["npm"]], &arguments, "npm is not installed (Debian package npm)")?;
        }
        SourceKind::Pip => {
            let mut arguments = vec!["download", "--no-deps", "--only-binary=:all:", "--quiet", "--retries=1"];
            if let [python, abi, platform] = source.wheel.split('-').collect::<Vec<_>>()[..] {
                let version = python.trim_start_matches(|character: char| character.is_ascii_alphabetic());
                arguments.extend(["--implementation=cp", "--python-version", version, "--abi", abi]);
                arguments.extend(["--platform", platform]);
            }
            arguments.extend(["--dest", folder, &source.name]);
            let known: [&[&str]; 2] = [&["pip3"], &["python3", "-I", "-m", "pip"]];
            run(dir, &known, &arguments, "pip is not installed (Debian package python3-pip)")?;
        }
        SourceKind::Address => bail!("not a package: expected a source of npm or PyPI"),
    }
    let file = std::fs::read_dir(&destination)?.next().context("no package file was downloaded")??;
    Ok(file.path())
}

/// Runs the first available one of `programs` in the folder `dir`.
fn run(dir: &Path, programs: &[&[&str]], arguments: &[&str], missing: &str) -> Result<()> {
    for words in programs {
        let mut command = command_in(dir, Path::new(words[0]))?;
        let output = command.args(&words[1..]).args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).output();
        match output {
            Ok(output) if output.status.success() => return Ok(()),
            Ok(output) => {
                let message = String::from_utf8_lossy(&output.stderr);
                let lines = message.lines().map(str::trim).filter(|line| !line.is_empty());
                bail!("{} failed: {}", words.join(" "), lines.take(3).collect::<Vec<_>>().join("; "))
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(error).with_context(|| format!("cannot run {}", words[0])),
        }
    }
    Err(anyhow!("{missing}"))
}

/// Contents of the members `paths` of a package file, in that order. Errors: the file is not an archive, or a member
/// is missing or larger than 1 GiB.
pub(crate) fn members(kind: SourceKind, package: &Path, paths: &[&str]) -> Result<Vec<Vec<u8>>> {
    let file = input::open(package)?;
    let mut found = BTreeMap::new();
    if kind == SourceKind::Npm {
        let mut archive = tar::Archive::new(flate2::read::GzDecoder::new(file));
        for member in archive.entries()? {
            let member = member?;
            let name = member.path()?.to_string_lossy().into_owned();
            if paths.contains(&name.as_str()) && member.header().entry_type().is_file() {
                found.insert(name, content(member)?);
            }
            if found.len() == paths.len() {
                break;
            }
        }
    } else {
        let mut archive = zip::ZipArchive::new(file)?;
        for &path in paths {
            let member = archive.by_name(path).with_context(|| format!("the package does not contain {path}"))?;
            found.insert(path.to_owned(), content(member)?);
        }
    }
    paths
        .iter()
        .map(|path| found.get(*path).cloned().with_context(|| format!("the package does not contain {path}")))
        .collect()
}

fn content(member: impl Read) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    member.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    ensure!(bytes.len() as u64 <= MAX_BYTES, "a file in the package is larger than 1 GiB");
    Ok(bytes)
}
