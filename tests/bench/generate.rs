//! `cargo bench -- generate`.

use super::child;
use super::report::{Report, median};
use anyhow::{Result, ensure};
use orator_base::stage::progress::Progress;
use orator_base::types::device::DeviceChoice;
use orator_base::types::skeleton::{N_BONES, N_JOINTS};
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::generator::CHUNK;
use orator_gesture::generate::model::SpeakerMetadata;
use orator_gesture::generate::normalisation::{N_FEATURES, Normalisation};
use orator_gesture::generate::representation::Representation;
use orator_nn::device::{self, Device};
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::params::Params;
use orator_test_support::drawn::speech::Speech;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::time::Instant;

/// Generation of motion from speech with both presets at full size: speed relative to real time, and peak memory. The
/// speech is synthetic, the weights are random. Measures from samples to joints, including the spectrogram but no file
/// access.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Seconds of speech.
    #[arg(long, default_value_t = 600.0, value_name = "SECS")]
    secs: f64,
    /// Rounds; each measures every preset once.
    #[arg(long, default_value_t = 1, value_name = "N")]
    rounds: usize,
    /// Threads.
    #[arg(long, default_value_t = 1, value_name = "N")]
    threads: usize,
    /// Frames per chunk, a multiple of 32; default: that of `orator generate`.
    #[arg(long, value_name = "N")]
    chunk: Option<usize>,
    /// Measure only this preset.
    #[arg(long, value_name = "light|paper")]
    preset: Option<Preset>,
    /// Device of the network.
    #[arg(long, default_value = "cpu", value_name = "cpu|cuda|cuda:N")]
    device: DeviceChoice,
}

/// Frame rate of the generated motion.
const FPS: FrameRate = FrameRate::new(15, 1);

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(args.secs >= 1.0 && args.secs < 1e6, "--secs is {}, expected 1 to a million", args.secs);
    ensure!(args.rounds > 0 && args.threads > 0, "nothing to measure: there must be rounds and threads");
    let (device, _) = device::open(args.device, || None)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build()?;
    let presets = [("light", Preset::Light), ("paper", Preset::Paper)];
    let presets: Vec<_> = presets.into_iter().filter(|(_, p)| args.preset.is_none_or(|only| only == *p)).collect();
    let sound = speech(args.secs);
    let task = progress.begin("generate", (args.rounds * presets.len()) as u64);
    // The smaller preset first: the peak memory is that of the process so far.
    let measured = presets.iter().map(|(name, preset)| {
        task.detail(name);
        let speaker = untrained(*preset, &device)?;
        let mut secs = Vec::new();
        for _ in 0..args.rounds {
            let start = Instant::now();
            let stream = std::iter::once(Ok(sound.samples.clone()));
            let chunk = args.chunk.unwrap_or(CHUNK);
            let (motion, _) =
                pool.install(|| speaker.motion_from_stream(stream, sound.samples.len(), &[], chunk, &mut |_| ()))?;
            secs.push(start.elapsed().as_secs_f64());
            ensure!(motion.joints.iter().all(|v| v.is_finite()), "the generated motion is not finite");
            task.advance(1);
        }
        Ok((*name, median(secs), child::own_peak_mib()))
    });
    let measured = measured.collect::<Result<Vec<_>>>()?;
    drop(task);

    let mut lines = vec![format!(
        "{:.0} s of speech, {}, {} thread(s), median of {} round(s); before it {:.0} MiB are the sound's",
        args.secs,
        args.device,
        args.threads,
        args.rounds,
        sound.samples.len() as f64 * 4.0 / 1024.0 / 1024.0
    )];
    let mut facts = json!({ "audio_secs": args.secs, "threads": args.threads });
    for (name, secs, peak_mib) in measured {
        let speed = args.secs / secs;
        lines.push(format!("{name:6} {secs:8.2} s  {speed:6.0} x real time  peak memory {peak_mib:.0} MiB"));
        facts[name] = json!({ "secs": secs, "times_real_time": speed, "peak_mib": peak_mib });
    }
    Ok(Report { text: lines.join("\n"), facts })
}

fn speech(secs: f64) -> Sound {
    let mut rng = ChaCha8Rng::seed_from_u64(1337);
    Speech::new(secs, &mut rng).sound(secs, &mut rng)
}

/// A speaker with random weights.
fn untrained(preset: Preset, device: &Device) -> Result<GestureGenerator> {
    let network = Config::from_preset(preset, N_FEATURES);
    let mut random = Params::new(1337);
    Generator::new(&mut random, &network)?;
    let mut params = Params::frozen().on(device);
    let generator = Generator::new(&mut params, &network)?;
    params.load(&random.tensors()?)?;
    let table = ndarray::Array2::from_elem((N_JOINTS, 3), 0.1);
    let normalisation = Normalisation::new(&table, &table, vec![0.1; N_BONES]);
    let facts = SpeakerMetadata::new("untrained", FPS, "", network, normalisation, Representation::Positions);
    Ok(GestureGenerator::new(facts, generator))
}
