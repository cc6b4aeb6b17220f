//! `cargo bench -- render`.

use super::super::report::{Report, median};
use anyhow::{Context, Result, ensure};
use orator_avatar::animate::export::film::{Film, FilmSource, SecondPanel, write as write_film};
use orator_avatar::animate::export::film_avatar::{AvatarView, FilmCamera};
use orator_avatar::animate::{AnimationOptions, perform};
use orator_avatar::render::{Background, Light, Mesh, PinholeCamera};
use orator_base::stage::progress::{Progress, Silent};
use orator_base::types::image::Image;
use orator_base::types::time::FrameRate;
use orator_lab::demo::scenery;
use orator_media::ffmpeg::write::encode::VideoWriter;
use orator_test_support::drawn::speech::Speech;
use orator_test_support::rule::rule::RuleGestures;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::time::Instant;

/// Rendering of the avatar at 1280 x 720 px on one core: posing and drawing, with shadows; and once the background of a
/// desk and a wall. Then a complete film, as `orator animate` writes it, and only the encoder on the same frames.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Frames per round.
    #[arg(long, default_value_t = 150, value_name = "N")]
    frames: usize,
    /// Rounds; each measures every step once.
    #[arg(long, default_value_t = 5, value_name = "N")]
    rounds: usize,
}

const SIZE: [usize; 2] = [1280, 720];
/// Number of film frames that the encoder benchmark cycles through.
const N_FRAMES_ENCODED: usize = 30;
/// Frame rate of the film and of real time.
const FPS: FrameRate = FrameRate::new(30, 1);

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(args.rounds > 0 && args.frames > 0, "nothing to measure: there must be rounds and frames");
    let mut rng = ChaCha8Rng::seed_from_u64(1337);
    let secs = FPS.secs(args.frames);
    let speech = Speech::new(secs, &mut rng);
    let motion = RuleGestures::with_variation(&speech, &[], secs, &mut rng).motion(args.frames, FPS);
    let performance = perform(&motion, None, &AnimationOptions::default());
    let mut view = AvatarView::new(&performance, &[&performance], SIZE, FilmCamera::Front);
    let folder = tempfile::tempdir()?;
    let task = progress.begin("render", args.rounds as u64);
    let (camera, second_panel) = (FilmCamera::Front, SecondPanel::Itself);
    let content = FilmSource { performance: &performance, camera, sound: None, second_panel };
    let mut film = Film::new(content);
    let films: Vec<Image> =
        (0..args.frames.min(N_FRAMES_ENCODED)).map(|frame| film.frame(frame)).collect::<Result<_>>()?;
    let mut secs: [Vec<f64>; 4] = Default::default();
    for _ in 0..args.rounds {
        let start = Instant::now();
        for frame in 0..args.frames {
            std::hint::black_box(view.frame(frame, 0.3));
        }
        secs[0].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        std::hint::black_box(desk());
        secs[1].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        let mut writer = VideoWriter::create(&folder.path().join("film.mp4"), SIZE[0], SIZE[1], FPS, None)?;
        for frame in (0..films.len()).cycle().take(args.frames) {
            writer.push(&films[frame])?;
        }
        writer.finish().context("the film")?;
        secs[2].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        let path = folder.path().join("whole.mp4");
        write_film(&path, content, &Silent).context("the film")?;
        secs[3].push(start.elapsed().as_secs_f64());
        task.advance(1);
    }
    drop(task);
    let [drawing, scene, encoding, film_secs] = secs.map(median);
    let per_frame = |secs: f64| 1e3 * secs / args.frames as f64;
    let speed = FPS.secs(args.frames) / drawing;
    let text = format!(
        "{} frames of {} x {} px, one avatar of {} triangles, median of {} round(s)\n\
         posing and drawing    {:6.2} ms a frame, {speed:.1} x real time at {FPS}\n\
         a scene, once         {:6.1} ms\n\
         the encoder alone     {:6.2} ms a frame\n\
         a whole film          {:6.2} ms a frame, {:.2} x the encoder alone",
        args.frames,
        SIZE[0],
        SIZE[1],
        view.n_triangles(),
        args.rounds,
        per_frame(drawing),
        1e3 * scene,
        per_frame(encoding),
        per_frame(film_secs),
        film_secs / encoding,
    );
    let facts = json!({
        "frames": args.frames,
        "triangles": view.n_triangles(),
        "draw_ms": per_frame(drawing),
        "times_real_time": speed,
        "scene_ms": 1e3 * scene,
        "encode_ms": per_frame(encoding),
        "film_ms": per_frame(film_secs),
        "film_per_encoder": film_secs / encoding,
    });
    Ok(Report { text, facts })
}

/// Background: a desk in front of a wall.
fn desk() -> Background {
    let square = |corners: [[f32; 3]; 4], normal: [f32; 3]| Mesh {
        points: corners.to_vec(),
        normals: vec![normal; 4],
        colours: vec![[0.4; 3]; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        labels: vec![0; 4],
        gloss: 0.0,
        n_closed: 0,
    };
    let wall = square(
        [[-300.0, 0.0, -90.0], [300.0, 0.0, -90.0], [300.0, 300.0, -90.0], [-300.0, 300.0, -90.0]],
        [0.0, 0.0, 1.0],
    );
    let desk =
        square([[-80.0, 95.0, 70.0], [80.0, 95.0, 70.0], [80.0, 95.0, 15.0], [-80.0, 95.0, 15.0]], [0.0, 1.0, 0.0]);
    let camera = PinholeCamera::looking_at(SIZE, 1500.0, [0.0, 150.0, 260.0], [0.0, 125.0, 0.0], 0.0);
    scenery::background(
        &camera,
        &[&wall, &desk],
        &Light::studio([-0.5, 0.8, 0.7]),
        Image::filled(SIZE[0], SIZE[1], [0; 3]),
    )
}
