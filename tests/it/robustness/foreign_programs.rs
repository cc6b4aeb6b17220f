//! Foreign programs (Python, npm, pip, cluster clients) run, load and read no files of the working directory.

use crate::fixtures::clips::tone;
use crate::fixtures::faults::shim::path_with;
use crate::fixtures::source_models::packages::{package_models, script};
use orator_formats::wav;
use orator_test_support::project::Project;
use orator_test_support::skip::skip;
use std::ffi::OsString;
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpListener;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Arc, Mutex};

const MODULES: [&str; 6] = ["pocketsphinx", "os", "pip", "sitecustomize", "importlib/__init__", "encodings/__init__"];
const PROGRAMS: [&str; 8] = ["python3", "npm", "node", "pip3", "scontrol", "sbatch", "kubectl", "ssh"];

/// A working directory with planted modules and programs, each of which writes to the file `ran` when executed.
struct Planted {
    dir: tempfile::TempDir,
}

impl Planted {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        plant(dir.path());
        Self { dir }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().canonicalize().unwrap().join(name)
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        command.args(args).current_dir(self.dir.path()).env("PATH", path_after_working_directory(None));
        command
    }
}

fn plant(dir: &Path) {
    let ran = dir.join("ran");
    for module in MODULES {
        let file = dir.join(module).with_extension("py");
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, format!("open({ran:?}, 'a').write({module:?})\n")).unwrap();
    }
    PROGRAMS.iter().for_each(|name| script(&dir.join(name), &format!("echo \"$0\" >> '{}'", ran.display())));
}

/// A search path that starts with the working directory, as a dot and as an empty entry.
fn path_after_working_directory(bin: Option<&Path>) -> OsString {
    let mut path = OsString::from(".::");
    path.push(bin.map_or_else(|| std::env::var_os("PATH").unwrap(), path_with));
    path
}

fn text_of(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

#[track_caller]
fn expect_none_ran(dir: &Path, output: &Output) {
    let ran = fs::read_to_string(dir.join("ran"));
    assert!(ran.is_err(), "{ran:?} ran: {}", text_of(output));
}

/// Interpreter behind `python3`, which may itself be a script of a version manager.
#[track_caller]
fn real_python() -> Option<String> {
    let output = Command::new("python3").args(["-c", "import sys; print(sys.executable)"]).output();
    let found = output.ok().filter(|output| output.status.success());
    if found.is_none() {
        skip("no python3");
    }
    found.map(|output| String::from_utf8(output.stdout).unwrap().trim().to_owned())
}

#[test]
fn python_imports_no_module_from_the_working_directory() {
    let Some(python) = real_python() else { return };
    let planted = Planted::new();
    for args in [&["doctor"][..], &["align", "a.wav", "a.txt", "--out", "a.words.json"]] {
        let output = planted.command(args).env("ORATOR_PYTHON", "python3").output().unwrap();
        expect_none_ran(planted.dir.path(), &output);
    }

    // Without pip3, Python runs its pip module.
    let (models, bin) = (planted.path("models"), planted.path("bin"));
    [&models, &bin].into_iter().for_each(|folder| fs::create_dir(folder).unwrap());
    fs::write(models.join("manifest.toml"), package_models(&bin, &["pip"])).unwrap();
    fs::remove_file(planted.path("pip3")).unwrap();
    script(&bin.join("python3"), &format!("exec '{python}' \"$@\""));
    let mut command = planted.command(&["models", "fetch", "person-packed"]);
    command.env("PATH", format!(".::{}", bin.display())).env("PIP_INDEX_URL", "http://127.0.0.1:9/");
    let output = command.env_remove("PIP_FIND_LINKS").output().unwrap();
    expect_none_ran(planted.dir.path(), &output);
    assert!(text_of(&output).contains("python3 -I -m pip failed"), "{}", text_of(&output));
}

#[test]
fn python_of_an_environment_in_the_working_directory_has_its_packages() {
    if real_python().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let mut make = Command::new("python3");
    make.args(["-m", "venv", "--without-pip", "aligner"]).current_dir(dir.path());
    assert!(make.status().unwrap().success(), "python3 -m venv");
    let version = fs::read_dir(dir.path().join("aligner/lib")).unwrap().next().unwrap().unwrap().path();
    let packages = version.join("site-packages");
    fs::create_dir(packages.join("pocketsphinx-5.1.1.dist-info")).unwrap();
    fs::write(packages.join("pocketsphinx.py"), "").unwrap();
    let about = "Metadata-Version: 2.1\nName: pocketsphinx\nVersion: 5.1.1\n";
    fs::write(packages.join("pocketsphinx-5.1.1.dist-info/METADATA"), about).unwrap();
    plant(dir.path());
    fs::remove_file(dir.path().join("python3")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output = command.arg("doctor").current_dir(dir.path()).env("ORATOR_PYTHON", "aligner/bin/python").output();
    let output = output.unwrap();
    assert!(text_of(&output).contains("pocketsphinx 5.1.1 (aligner/bin/python)"), "{}", text_of(&output));
    expect_none_ran(dir.path(), &output);
}

/// A configured Python keeps its path with its links, and runs isolated in an empty folder that is removed afterwards.
#[test]
fn python_runs_in_an_empty_temporary_folder() {
    let planted = Planted::new();
    let log = planted.path("log");
    for folder in ["real", "env", "temporary"] {
        fs::create_dir(planted.path(folder)).unwrap();
    }
    // Prints a version, or for two words that neither is aligned.
    let lines = format!(
        "{{ echo \"$0 $1 $2\"; pwd; ls -A; }} >> '{}'\n\
         case \"$3\" in *print\\(m.version*) echo 5.1.1;; *) echo; cat > /dev/null; echo -; echo -;; esac",
        log.display()
    );
    script(&planted.path("real/python"), &lines);
    symlink("../real/python", planted.path("env/python")).unwrap();
    wav::write(&planted.path("a.wav"), &tone(16_000, 1.0, 200.0)).unwrap();
    fs::write(planted.path("a.txt"), "good evening").unwrap();
    let align: &[&str] = &["align", "a.wav", "a.txt", "--out", "a.words.json", "--python", "env/python"];
    for (args, n_processes) in [(&["doctor"][..], 1), (align, 2)] {
        let mut command = planted.command(args);
        command.env("ORATOR_PYTHON", "./env/python").env("TMPDIR", planted.path("temporary"));
        let output = command.output().unwrap();
        expect_none_ran(planted.dir.path(), &output);
        let text = fs::read_to_string(&log).unwrap_or_default();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 2 * n_processes, "the folder is not empty: {text}{}", text_of(&output));
        for process in lines.chunks(2) {
            assert_eq!(process[0], format!("{} -I -c", planted.path("env/python").display()));
            assert!(Path::new(process[1]).starts_with(planted.path("temporary")), "{text}");
        }
        assert_eq!(fs::read_dir(planted.path("temporary")).unwrap().count(), 0, "{}", text_of(&output));
        fs::remove_file(&log).unwrap();
    }
}

/// A registry without packages that records its requests.
struct Registry {
    port: u16,
    requests: Arc<Mutex<String>>,
}

impl Registry {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (port, requests) = (listener.local_addr().unwrap().port(), Arc::new(Mutex::new(String::new())));
        let recorded = requests.clone();
        std::thread::spawn(move || {
            for mut stream in listener.incoming().flatten() {
                let mut head = [0; 4096];
                let n = stream.read(&mut head).unwrap_or(0);
                recorded.lock().unwrap().push_str(&String::from_utf8_lossy(&head[..n]));
                let answer = "HTTP/1.1 404 Not Found\r\ncontent-length: 2\r\nconnection: close\r\n\r\n{}";
                let _ = stream.write_all(answer.as_bytes());
            }
        });
        Self { port, requests }
    }

    fn requests(&self) -> String {
        self.requests.lock().unwrap().clone()
    }
}

#[test]
fn npm_uses_only_the_registry_of_the_user() {
    if !Command::new("npm").arg("--version").output().is_ok_and(|output| output.status.success()) {
        return skip("no npm");
    }
    let root = tempfile::tempdir().unwrap();
    let (own, planted) = (Registry::start(), Registry::start());
    let project = root.path().join("project");
    let models = project.join("models");
    let home = root.path().join("home");
    [&models, &home].into_iter().for_each(|folder| fs::create_dir_all(folder).unwrap());
    fs::write(home.join(".npmrc"), format!("registry=http://127.0.0.1:{}/\n", own.port)).unwrap();
    // The folders above the models are npm projects whose workspaces include the download folder.
    let downloads = ["project/models/.downloads/*", "models/.downloads/*", ".downloads/*"];
    for folder in [root.path(), &project, &models] {
        fs::write(folder.join(".npmrc"), format!("registry=http://127.0.0.1:{}/${{TOKEN}}/\n", planted.port)).unwrap();
        fs::write(folder.join("package.json"), format!("{{\"workspaces\": {downloads:?}}}")).unwrap();
        fs::create_dir(folder.join("node_modules")).unwrap();
    }
    fs::write(models.join("manifest.toml"), package_models(&home, &["npm"])).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(["models", "fetch", "person-packed"]).current_dir(&project);
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().to_lowercase().starts_with("npm_config_") {
            command.env_remove(name);
        }
    }
    command.env("HOME", &home).env("TOKEN", "secret").env("NO_PROXY", "127.0.0.1").env("no_proxy", "127.0.0.1");
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", text_of(&output));
    assert!(own.requests().contains("GET /host"), "{}", text_of(&output));
    assert_eq!(planted.requests(), "");
}

#[test]
fn cluster_clients_are_the_installed_ones_and_find_named_files() {
    let project = Project::with_clips("foreign", 1, 1.0);
    assert_eq!(project.answer(&["plan"]).code, 0);
    let dir = project.dir().canonicalize().unwrap();
    plant(&dir);
    let bin = tempfile::tempdir().unwrap();
    let log = bin.path().join("log");
    // Logs name, working directory, number of files in it, and configuration; sbatch prints the number of the job.
    let lines = format!(
        "name=${{0##*/}}\necho \"$name $(pwd) $(ls -A | wc -l) $KUBECONFIG\" >> '{}'\n\
         [ $name != sbatch ] || echo 7",
        log.display()
    );
    ["scontrol", "sbatch", "kubectl", "ssh"].iter().for_each(|name| script(&bin.path().join(name), &lines));
    let kubernetes = ["kubernetes", "--image", "registry/orator:1", "--claim", "project", "--mount", "/project"];
    for (to, programs) in [
        (&["slurm", "--tasks", "1", "--hours", "1"][..], &["scontrol", "sbatch", "sbatch"][..]),
        (&kubernetes, &["kubectl"]),
        (&["ssh", "a"], &["ssh"]),
    ] {
        let mut command = project.command(&[&["submit"], to, &["--plan", "work/plan.json"]].concat());
        command.env("PATH", path_after_working_directory(Some(bin.path()))).env("KUBECONFIG", "kube/config:/etc/other");
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", text_of(&output));
        expect_none_ran(&dir, &output);
        let text = fs::read_to_string(&log).unwrap();
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines.iter().map(|line| line[0]).collect::<Vec<_>>(), programs, "{text}");
        for line in &lines {
            let is_in_project = Path::new(line[1]) == dir;
            assert_eq!(is_in_project, line[0] == "sbatch", "{text}");
            assert!(is_in_project || line[2] == "0", "its folder is not empty: {text}");
        }
        if programs == ["kubectl"] {
            assert_eq!(lines[0][3], format!("{}:/etc/other", dir.join("kube/config").display()));
        }
        fs::remove_file(&log).unwrap();
    }
}
