//! Videos are read in sandboxed processes: forbidden operations fail, the output is identical to that of one process,
//! and the end of such a process, or of the run that started it, affects no other work.

use crate::fixtures::media::recogniser::project_with_words;
use orator::{Pipeline, Selection, Silent, StageName, UnreadableMedia, load_config};
use orator_media::sandbox::{FileAccess, restrict, restrict_thread};
use orator_pipeline::process::{Limits, VERB, ask_media, probe};
use orator_test_support::project::{Project, files_under};
use orator_test_support::skip::skip;
use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_orator");

/// Whether the kernel restricts processes; prints a skip line if not.
fn is_active() -> bool {
    let restriction = probe(Path::new(PROGRAM)).unwrap();
    if !restriction.is_active() {
        skip(&format!("the sandbox is {restriction}"));
    }
    restriction.is_active()
}

#[test]
fn a_restricted_thread_cannot_write_elsewhere_connect_or_execute() {
    if !is_active() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    for folder in ["out", "in"] {
        fs::create_dir(dir.path().join(folder)).unwrap();
        fs::write(dir.path().join(folder).join("a"), folder).unwrap();
    }
    fs::write(dir.path().join("secret"), "secret").unwrap();
    let folder = dir.path().to_owned();
    // A separate thread, so that the other tests of this process stay unrestricted.
    std::thread::spawn(move || attempt_everything(&folder)).join().unwrap();
    assert_eq!(fs::read_to_string(dir.path().join("secret")).unwrap(), "secret");
    assert_eq!(fs::read_to_string(dir.path().join("out/new")).unwrap(), "new");
}

fn attempt_everything(dir: &Path) {
    use std::net::{TcpListener, TcpStream, UdpSocket};
    use std::os::unix::fs::{PermissionsExt as _, symlink};
    use std::os::unix::net::{UnixDatagram, UnixListener, UnixStream};
    let (out, input, secret) = (dir.join("out"), dir.join("in"), dir.join("secret"));
    let restriction = restrict_thread(&FileAccess { reads: Some(vec![input.join("a")]), writes: vec![out.clone()] });
    assert!(restriction.is_active(), "{restriction}");

    fs::write(out.join("new"), "new").unwrap();
    fs::create_dir(out.join("folder")).unwrap();
    fs::rename(out.join("new"), out.join("newer")).unwrap();
    fs::rename(out.join("newer"), out.join("new")).unwrap();
    assert_eq!(fs::read_to_string(input.join("a")).unwrap(), "in");
    assert_eq!(std::thread::spawn(|| 1).join().unwrap(), 1);

    let mode = || fs::Permissions::from_mode(0o777);
    let attempts: [(&str, std::io::Result<()>); 21] = [
        ("a file outside", fs::write(dir.join("new"), "")),
        ("a file outside changed", fs::write(&secret, "")),
        ("a file outside removed", fs::remove_file(&secret)),
        ("a file outside renamed", fs::rename(&secret, out.join("secret"))),
        ("a file outside linked", fs::hard_link(&secret, out.join("secret"))),
        ("a file outside read", fs::read(&secret).map(drop)),
        ("an input changed", fs::write(input.join("a"), "")),
        ("a folder listed", fs::read_dir(dir).map(drop)),
        ("a folder outside", fs::create_dir(dir.join("folder"))),
        ("a symbolic link", symlink("/etc/passwd", out.join("link"))),
        ("another mode", fs::set_permissions(out.join("new"), mode())),
        ("another mode outside", fs::set_permissions(&secret, mode())),
        ("/etc/passwd read", fs::read("/etc/passwd").map(drop)),
        ("UDP", UdpSocket::bind("127.0.0.1:0").map(drop)),
        ("TCP in", TcpListener::bind("127.0.0.1:0").map(drop)),
        ("TCP out", TcpStream::connect("127.0.0.1:9").map(drop)),
        ("a local socket", UnixDatagram::unbound().map(drop)),
        ("a pair of sockets", UnixStream::pair().map(drop)),
        ("a socket with a name", UnixListener::bind(out.join("socket")).map(drop)),
        ("a program", Command::new("/bin/true").status().map(drop)),
        ("the program itself", Command::new(PROGRAM).status().map(drop)),
    ];
    for (operation, result) in attempts {
        let error = result.expect_err(operation);
        // A forbidden link or move is reported as one to another file system.
        let is_denied = matches!(error.kind(), ErrorKind::PermissionDenied | ErrorKind::CrossesDevices);
        assert!(is_denied, "{operation}: {error}");
    }
    attempt_calls();
}

/// Makes a system call with null pointers, and returns its error number.
fn call(number: libc::c_long, arguments: &[libc::c_long]) -> Option<i32> {
    let at = |idx: usize| arguments.get(idx).copied().unwrap_or(0);
    // SAFETY: with null pointers the tried calls access no memory of this process, and a new mapping is never accessed.
    let answer = unsafe { libc::syscall(number, at(0), at(1), at(2), at(3), at(4), at(5)) };
    (answer < 0).then(std::io::Error::last_os_error).and_then(|error| error.raw_os_error())
}

/// Calls that act on the parent process or allocate uncounted memory. Without the filter they would not fail with
/// EPERM, and would have no effect.
fn attempt_calls() {
    let parent = libc::c_long::from(std::os::unix::process::parent_id());
    let first = |number: i32| libc::c_long::from(number);
    let shared = first(libc::MAP_SHARED | libc::MAP_ANONYMOUS);
    let forbidden: &[(&str, libc::c_long, &[libc::c_long])] = &[
        ("setpriority", libc::SYS_setpriority, &[0, parent]),
        ("setpriority of a group", libc::SYS_setpriority, &[1, 0]),
        ("setpriority of a user", libc::SYS_setpriority, &[2, 0]),
        ("ioprio_set", libc::SYS_ioprio_set, &[1, parent]),
        ("ioprio_set of a group", libc::SYS_ioprio_set, &[2, 0]),
        ("sched_setaffinity", libc::SYS_sched_setaffinity, &[parent]),
        ("sched_setscheduler", libc::SYS_sched_setscheduler, &[parent]),
        ("sched_setparam", libc::SYS_sched_setparam, &[parent]),
        ("sched_setattr", libc::SYS_sched_setattr, &[parent]),
        ("prlimit64", libc::SYS_prlimit64, &[parent]),
        ("setpgid", libc::SYS_setpgid, &[parent]),
        ("get_robust_list", libc::SYS_get_robust_list, &[parent]),
        ("kcmp", libc::SYS_kcmp, &[parent, parent]),
        ("ptrace", libc::SYS_ptrace, &[16, parent]),
        ("process_vm_readv", libc::SYS_process_vm_readv, &[parent]),
        ("process_vm_writev", libc::SYS_process_vm_writev, &[parent]),
        ("process_madvise", libc::SYS_process_madvise, &[-1]),
        ("process_mrelease", libc::SYS_process_mrelease, &[-1]),
        ("migrate_pages", libc::SYS_migrate_pages, &[parent]),
        ("move_pages", libc::SYS_move_pages, &[parent]),
        ("pidfd_open", libc::SYS_pidfd_open, &[parent]),
        ("pidfd_getfd", libc::SYS_pidfd_getfd, &[-1]),
        ("pidfd_send_signal", libc::SYS_pidfd_send_signal, &[-1]),
        ("kill", libc::SYS_kill, &[parent, first(libc::SIGCONT)]),
        ("tkill", libc::SYS_tkill, &[parent, first(libc::SIGCONT)]),
        ("tgkill", libc::SYS_tgkill, &[parent, parent, first(libc::SIGCONT)]),
        ("rt_sigqueueinfo", libc::SYS_rt_sigqueueinfo, &[parent, first(libc::SIGCONT)]),
        ("rt_tgsigqueueinfo", libc::SYS_rt_tgsigqueueinfo, &[parent, parent, first(libc::SIGCONT)]),
        ("F_SETOWN", libc::SYS_fcntl, &[-1, first(libc::F_SETOWN), parent]),
        ("F_SETOWN_EX", libc::SYS_fcntl, &[-1, 15]),
        ("PR_SCHED_CORE", libc::SYS_prctl, &[first(libc::PR_SCHED_CORE), 2, parent]),
        ("PR_SET_PDEATHSIG", libc::SYS_prctl, &[first(libc::PR_SET_PDEATHSIG), 0]),
        ("shmat", libc::SYS_shmat, &[-1]),
        ("memfd_create", libc::SYS_memfd_create, &[]),
        ("shared memory", libc::SYS_mmap, &[0, 4096, 1, shared, -1]),
    ];
    for (name, number, arguments) in forbidden {
        assert_eq!(call(*number, arguments), Some(libc::EPERM), "{name}");
    }
    // Calls on the thread itself, as thread pools make them.
    assert_eq!(call(libc::SYS_sched_setaffinity, &[0]), Some(libc::EINVAL));
    assert_eq!(call(libc::SYS_prlimit64, &[0]), None);
    assert_eq!(call(libc::SYS_setpriority, &[0, 0, 19]), None);
    assert_eq!(call(libc::SYS_mmap, &[0, 4096, 1, first(libc::MAP_PRIVATE | libc::MAP_ANONYMOUS), -1]), None);
}

#[test]
fn a_process_over_its_memory_limit_reports_the_limit() {
    let project = Project::with_clips("memory-limit", 1, 1.0);
    let ask = |limits: &Limits| ask_media(Path::new(PROGRAM), &project.clips()[0], limits);
    let header = ask(&Limits::of_header()).unwrap();
    assert!(header.secs.is_some() && header.image_size[0] > 0, "{header:?}");
    let error = format!("{:#}", ask(&Limits { memory: 1 << 20, ..Limits::of_header() }).unwrap_err());
    assert!(error.contains("mp4: reading it needs more than the 1 MiB of memory"), "{error}");
}

#[test]
fn a_named_pipe_as_a_video_is_rejected_immediately() {
    let dir = tempfile::tempdir().unwrap();
    let source = dir.path().join("pipe.mp4");
    assert!(Command::new("mkfifo").arg(&source).status().unwrap().success());
    let limits = Limits { idle_secs: 60, ..Limits::of_header() };
    let error = ask_media(Path::new(PROGRAM), &source, &limits).unwrap_err();
    let error = format!("{error:#}");
    assert!(error.contains("pipe.mp4") && error.ends_with("it is a named pipe, expected a regular file"), "{error}");
}

#[test]
fn a_process_with_threads_is_not_reported_as_restricted() {
    let late = restrict(&FileAccess::default());
    assert!(!late.is_active() && late.to_string().contains("the process already had"), "{late}");
    fs::write(tempfile::tempdir().unwrap().path().join("a"), "").unwrap();
}

#[test]
fn doctor_reports_whether_the_sandbox_is_active() {
    let project = Project::with_clips("doctor", 0, 1.0);
    let found = |args: &[&str]| {
        let answer = project.answer(&[&["doctor"], args].concat());
        let checks = answer.json["checks"].as_array().unwrap().clone();
        let sandbox = checks.into_iter().find(|check| check["name"] == "sandbox").unwrap();
        sandbox["found"].as_str().unwrap().to_owned()
    };
    assert!(found(&["--set", "work.sandbox=false"]).starts_with("not active: work.sandbox"));
    if is_active() {
        let found = found(&[]);
        assert!(found.starts_with("active: files by Landlock ABI") && found.ends_with("seccomp"), "{found}");
    }
}

/// Output of a run except the hash cache, which contains paths and times.
fn output_files(work: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = files_under(work).into_iter().filter(|(name, _)| name != "hashes.json");
    files.map(|(name, path)| (name, fs::read(path).unwrap())).collect()
}

#[test]
fn separate_processes_give_the_same_bytes_as_one_process() {
    let project = project_with_words("same", 2, 4.6);
    fs::write(project.video("text.mp4"), "this is no video\n").unwrap();
    let pipeline = || Pipeline::open(load_config(&project.dir().join("pipeline.toml"), &[]).unwrap()).unwrap();
    let run = |pipeline: &Pipeline| {
        let report = pipeline.run(&Selection::default(), &Silent).unwrap();
        let [failure] = &report.failures[..] else { panic!("{:?}", report.failures) };
        let cause = failure.cause.as_ref().unwrap();
        assert!(cause.is::<UnreadableMedia>() && failure.error.contains("text.mp4"), "{cause:#}");
        assert_eq!(report.stages[&StageName::Lift].done, 2);
        let files = output_files(&project.work());
        fs::remove_dir_all(project.work()).unwrap();
        (serde_json::to_string(&report).unwrap(), files)
    };
    let (single, separate) = (run(&pipeline()), run(&pipeline().with_processes(PROGRAM.into())));
    assert_eq!(single.0, separate.0);
    assert_eq!(single.1.keys().collect::<Vec<_>>(), separate.1.keys().collect::<Vec<_>>());
    for (name, bytes) in &single.1 {
        assert!(separate.1[name] == *bytes, "{name} differs");
    }
    assert!(single.1.keys().any(|name| name.ends_with(".tar")));
}

/// Id of a unit's process that the run has started; waits for one.
fn unit_of(run: &mut Child) -> Option<u32> {
    while run.try_wait().unwrap().is_none() {
        let tasks = fs::read_dir(format!("/proc/{}/task", run.id())).into_iter().flatten().flatten();
        let children = tasks.filter_map(|task| fs::read_to_string(task.path().join("children")).ok());
        let ids: Vec<u32> = children
            .flat_map(|ids| ids.split_whitespace().filter_map(|id| id.parse().ok()).collect::<Vec<_>>())
            .collect();
        let is_unit =
            |id: &u32| fs::read_to_string(format!("/proc/{id}/cmdline")).is_ok_and(|line| line.contains(VERB));
        if let Some(id) = ids.into_iter().find(is_unit) {
            return Some(id);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    None
}

fn signal(name: &str, id: u32) {
    assert!(Command::new("kill").args([format!("-{name}"), id.to_string()]).status().unwrap().success());
}

#[test]
fn a_process_that_dies_fails_only_its_unit() {
    let project = Project::with_clips("crash", 2, 4.6);
    for (name, number) in [("SEGV", "signal 11"), ("KILL", "signal 9")] {
        let mut command = Command::new(PROGRAM);
        command.current_dir(project.dir()).args(["--json", "run", "--jobs", "1"]).stdin(Stdio::null());
        let mut run = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        signal(name, unit_of(&mut run).unwrap());
        let output = run.wait_with_output().unwrap();
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let failures = json["failures"].as_array().unwrap();
        assert_eq!((output.status.code(), failures.len()), (Some(2), 1), "{json}");
        let error = failures[0]["error"].as_str().unwrap();
        assert!(error.contains(number) && error.contains("clip-"), "{error}");
        assert_eq!(
            (&json["stages"]["lift"]["done"], &json["stages"]["extract"]["failed"]),
            (&1.into(), &1.into()),
            "{json}"
        );
        assert_eq!(project.run(&[]).code, 0);
        fs::remove_dir_all(project.work()).unwrap();
    }
}

#[test]
fn termination_signals_do_not_end_unit_processes() {
    let project = Project::with_clips("stop-signals", 1, 4.6);
    let mut run = project.start(&["run", "--to", "segment"]);
    let mut signalled = std::collections::BTreeSet::new();
    while let Some(unit) = unit_of(&mut run) {
        // The process may have ended already.
        let _ = Command::new("kill").args(["-TERM", &unit.to_string()]).stderr(Stdio::null()).status().unwrap();
        signalled.insert(unit);
    }
    assert!(run.wait().unwrap().success() && !signalled.is_empty());
}

#[test]
fn every_thread_that_reads_a_video_is_restricted() {
    if !is_active() {
        return;
    }
    let project = Project::with_clips("threads", 1, 4.6);
    let mut run = project.start(&["run", "--to", "lift"]);
    let mut max_threads = 0;
    while let Some(unit) = unit_of(&mut run) {
        let tasks = fs::read_dir(format!("/proc/{unit}/task")).into_iter().flatten().flatten();
        let statuses: Vec<_> = tasks.filter_map(|task| fs::read_to_string(task.path().join("status")).ok()).collect();
        max_threads = max_threads.max(statuses.len());
        // A process with a single thread may not be restricted yet.
        for status in statuses.iter().filter(|_| statuses.len() > 1) {
            let has = |line: &str| status.lines().any(|other| other == line);
            assert!(has("Seccomp:\t2") && has("NoNewPrivs:\t1"), "{status}");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(run.wait().unwrap().success() && max_threads > 1, "{max_threads} threads");
}

#[test]
fn unit_processes_end_with_their_run() {
    let project = Project::with_clips("orphan", 1, 8.0);
    for _ in 0..3 {
        let mut run = project.start(&["run"]);
        let unit = unit_of(&mut run).unwrap();
        run.kill().unwrap();
        run.wait().unwrap();
        let is_alive = || {
            let status = fs::read_to_string(format!("/proc/{unit}/status")).unwrap_or_default();
            status.lines().any(|line| line.starts_with("State:") && !line.contains('Z') && !line.contains('X'))
        };
        let started = Instant::now();
        while is_alive() && started.elapsed() < Duration::from_secs(10) {
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(!is_alive(), "process {unit} is still running");
        eprintln!("ended {} ms after its run", started.elapsed().as_millis());
    }
    assert_eq!(project.run(&[]).code, 0);
}
