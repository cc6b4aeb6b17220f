//! `orator live`.

use crate::cli::Outcome;
use crate::cli::config_args::DeviceArgs;
use crate::cli::sandbox::{enter_sandbox, this_program};
use crate::cli::ui::Ui;
use anyhow::{Result, ensure};
use orator_base::stage::progress::Progress as _;
use orator_base::text::{counted, length};
use orator_base::types::device::DeviceChoice;
use orator_base::types::sound::SAMPLE_RATE;
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::model::{GenerationChoice, checkpoint_file, model_lock};
use orator_live::lines::JsonLines;
use orator_live::pose::LiveBody;
use orator_live::session::{self, LiveReport, PoseSink};
use orator_live::sound::LiveSound;
use orator_live::vmc::{DEFAULT_ADDRESS, VmcSocket};
use orator_view::live::LiveFeed;
use orator_view::view_server::{self, ViewRequest};
use serde_json::json;
use std::io::IsTerminal as _;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::mpsc::channel;

/// Gesture to speech while it is spoken.
///
/// Reads speech from standard input (16-bit little-endian samples, mono, 16 kHz), or --audio at its own speed, and sends
/// the motion at 60 poses a second: --vmc to programs for avatars (VSeeFace, Warudo, VNyan, receivers in Blender and
/// Unity), --lines as JSON, --page to a page with the avatar. Silence is inserted while speech is late; after a second
/// of silence the avatar comes to rest.
///
/// The model must be trained with a limited look-ahead: `orator train gan --set gan.look_ahead_secs=0.5`. The
/// motion follows the speech by this time and 0.17 s. `orator guide live` has microphones, avatars and voice agents.
#[derive(clap::Args)]
pub struct Args {
    /// Checkpoint of `orator train gan`, or its folder (the best checkpoint is used, else the newest).
    #[arg(long, value_name = "FILE|DIR")]
    checkpoint: PathBuf,
    /// Audio file to read at its own speed instead of standard input; it is not played.
    #[arg(long, value_name = "FILE")]
    audio: Option<PathBuf>,
    /// Speaker, for a model of several speakers.
    #[arg(long, value_name = "NAME")]
    speaker: Option<String>,
    /// Send VMC messages (OSC over UDP, one bundle per pose) to this address.
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = DEFAULT_ADDRESS)]
    vmc: Option<String>,
    /// Print each pose as a line of JSON: time, position of the hips and rotations of the VRM humanoid. With --json, the
    /// last line has the report.
    #[arg(long)]
    lines: bool,
    /// Serve a page with the avatar, or your own VRM avatar, on this machine.
    #[arg(long)]
    page: bool,
    /// Port of the page; 0 selects a free one.
    #[arg(long, default_value_t = 0, requires = "page")]
    port: u16,
    #[command(flatten)]
    device: DeviceArgs,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    ensure!(args.vmc.is_some() || args.lines || args.page, "nothing to send to: give --vmc, --lines or --page");
    ensure!(
        args.audio.is_some() || !std::io::stdin().is_terminal(),
        "standard input is a terminal, expected speech: give --audio, or connect a microphone (`orator guide live`)"
    );
    let device = args.device.open(DeviceChoice::Cpu, || None, ui)?;
    let mut vmc = args.vmc.as_deref().map(VmcSocket::connect).transpose()?;
    if device.is_cpu() && !args.page {
        enter_sandbox([], [args.checkpoint.as_path()]);
    }
    let (sound, is_file) = (LiveSound::default(), args.audio.is_some());
    read(sound.clone(), args.audio);
    let checkpoint = checkpoint_file(&args.checkpoint)?;
    let _lock = model_lock(&checkpoint)?;
    let choice = GenerationChoice { speaker: args.speaker, seed: None };
    let generator = GestureGenerator::open_as(&checkpoint, &choice, &device)?;
    let look_ahead = generator.look_ahead()?;
    let body = LiveBody::new(&generator.metadata);
    vmc = vmc.map(|socket| socket.with_bones(body.bones.clone()));
    ui.enable_stop_requests("stopping", "the session has ended");
    let mut lines = args.lines.then(|| JsonLines::new(std::io::stdout(), body.bones.clone()));
    let mut feed = args.page.then(|| LiveFeed::new(generator.name(), &body));
    if let Some(feed) = &feed {
        serve(feed.clone(), args.port, ui)?;
    }
    let delay = look_ahead.secs + session::delay(generator.fps()).as_secs_f64();
    ui.say(&format!("{} gestures {delay:.2} s after the speech", generator.name()));
    let sinks = [
        vmc.as_mut().map(|sink| sink as &mut dyn PoseSink),
        lines.as_mut().map(|sink| sink as &mut dyn PoseSink),
        feed.as_mut().map(|sink| sink as &mut dyn PoseSink),
    ];
    let mut sinks: Vec<&mut dyn PoseSink> = sinks.into_iter().flatten().collect();
    let report = session::run(&generator, body, (&sound, is_file), &mut sinks, ui)?;
    let text = text(&report);
    if args.lines && !ui.is_json() {
        // Standard output has the poses.
        ui.say(text.trim_end());
    } else if args.lines {
        ui.summary(&text, None, json!({ "report": report }));
    } else {
        ui.summary(&text, None, json!(report));
    }
    Ok(Outcome::Done)
}

/// Reads the speech on a thread of its own, from now on.
fn read(sound: LiveSound, audio: Option<PathBuf>) {
    std::thread::spawn(move || match audio {
        Some(path) => sound.read_file(&path),
        None => sound.read_pcm(std::io::stdin()),
    });
}

/// Serves the page from a thread until the program ends; prints its address.
fn serve(feed: LiveFeed, port: u16, ui: &Ui) -> Result<()> {
    let request = ViewRequest { project: None, file: None, live: Some(feed), author: None, program: this_program() };
    let (sender, opened) = channel();
    std::thread::spawn(move || {
        let listening = sender.clone();
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let ended = view_server::run(request, address, |url| {
            let _ = listening.send(Ok(url.to_owned()));
        });
        let _ = ended.map_err(|error| sender.send(Err(error)));
    });
    let url = opened.recv()??;
    ui.say(&format!("open {url}"));
    Ok(())
}

fn text(report: &LiveReport) -> String {
    let LiveReport { secs, look_ahead_secs, delay_ms, jitter_ms, sound, outputs, .. } = report;
    let mut text = format!(
        "{} of motion, {look_ahead_secs} s + {delay_ms:.0} ms after the speech; jitter {:.1} ms (99 %), {:.1} ms at \
         most\n",
        length(*secs),
        jitter_ms[0],
        jitter_ms[1]
    );
    if report.n_repeated + report.n_omitted > 0 {
        let (repeated, omitted) = (report.n_repeated, report.n_omitted);
        text += &format!("{repeated} poses repeated because the network was late, {omitted} omitted\n");
    }
    if sound.n_gaps > 0 {
        let silent = sound.n_silent_samples as f64 / f64::from(SAMPLE_RATE);
        text += &format!("speech was late {}; {} of silence inserted\n", counted(sound.n_gaps, "time"), length(silent));
    }
    if sound.n_skipped_samples > 0 {
        let skipped = sound.n_skipped_samples as f64 / f64::from(SAMPLE_RATE);
        text += &format!("{} of pauses skipped, because the speech stayed behind\n", length(skipped));
    }
    text += &sound.notes.iter().map(|note| format!("note: {note}\n")).collect::<String>();
    for output in outputs {
        text += &format!("{:6} {} poses sent, {} dropped\n", output.name, output.n_sent, output.n_dropped);
        text += &output.note.iter().map(|note| format!("note: {note}\n")).collect::<String>();
    }
    text
}
