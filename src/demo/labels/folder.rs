//! Labelled set in the form of COCO-WholeBody: pictures of rendered people under every condition. The parts `train` and
//! `val` are of the first and the middle part of the people; those of the last stay for measuring.

use super::person;
use super::person::UNLABELLED;
use crate::demo::people::condition::Condition;
use crate::demo::people::folder::{ClipSeeds, SetPart};
use crate::demo::people::scene::PeopleScene;
use crate::demo::people::truth::PointOwners;
use crate::external::ffmpeg::jpeg;
use crate::formats::coco_wholebody::{CocoImage, CocoLabels, CocoPerson, IMAGES};
use crate::render::Renderer;
use crate::stage::progress::Progress;
use crate::stage::workdir;
use crate::types::image::Image;
use crate::types::time::FrameRate;
use anyhow::{Result, ensure};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::path::Path;

/// Seconds of a scene and pictures taken of it.
const SECS: f64 = 4.0;
const PICTURES: usize = 2;
/// One in so many scenes is for `val`.
const VAL_EVERY: usize = 10;
/// Scenes rendered at a time.
const BATCH: usize = 32;
/// Quality of a JPEG under the condition of low bit rates.
const LOW_QUALITY: std::ops::RangeInclusive<i32> = 14..=31;
const LICENCE: &str = "cc0-1.0";

/// What a set holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LabelCounts {
    /// Pictures of `train` and of `val`.
    pub images: [usize; 2],
    /// Labelled people in both.
    pub people: usize,
}

/// Picture with its labels; the numbers are given later.
struct LabelledPicture {
    jpeg: Vec<u8>,
    size: [usize; 2],
    people: Vec<CocoPerson>,
}

/// Draws `n_images` pictures and their annotations into `dir`. Errors: no picture is wanted, the folder cannot be
/// written.
pub fn draw(dir: &Path, n_images: usize, seed: u64, progress: &dyn Progress) -> Result<LabelCounts> {
    ensure!((1..1_000_000).contains(&n_images), "--images takes 1 to 999999 pictures, not {n_images}");
    let task = progress.begin("draw labelled pictures", n_images as u64);
    let description = "People rendered by orator: 17 points of the body and 21 of each hand, exact";
    let mut parts = [0, 1].map(|_| CocoLabels::new(description, LICENCE));
    std::fs::create_dir_all(dir.join(IMAGES))?;
    let n_scenes = n_images.div_ceil(PICTURES);
    let (mut n_drawn, mut n_people) = (0, 0);
    for start in (0..n_scenes).step_by(BATCH) {
        let scenes: Vec<usize> = (start..(start + BATCH).min(n_scenes)).collect();
        let drawn: Vec<Vec<LabelledPicture>> =
            scenes.par_iter().map(|&number| pictures(number, seed)).collect::<Result<_>>()?;
        for (number, picture) in scenes.iter().zip(drawn).flat_map(|(n, of)| of.into_iter().map(move |p| (*n, p))) {
            if n_drawn == n_images {
                break;
            }
            n_drawn += 1;
            let (id, [width, height]) = (n_drawn as u64, picture.size);
            let file_name = format!("{id:06}.jpg");
            workdir::write_file(&dir.join(IMAGES).join(&file_name), &picture.jpeg)?;
            let part = &mut parts[usize::from(is_val(number))];
            part.images.push(CocoImage { id, file_name, width, height, license: 1 });
            for person in picture.people {
                n_people += 1;
                part.annotations.push(CocoPerson { id: n_people, image_id: id, ..person });
            }
            task.advance(1);
        }
    }
    for (labels, part) in parts.iter().zip(["train", "val"]) {
        labels.write(dir, part)?;
    }
    Ok(LabelCounts { images: parts.each_ref().map(|part| part.images.len()), people: n_people as usize })
}

fn is_val(number: usize) -> bool {
    number % VAL_EVERY == VAL_EVERY - 1
}

/// Pictures of a scene at times of their own.
fn pictures(number: usize, seed: u64) -> Result<Vec<LabelledPicture>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Beyond the streams that clips are drawn from.
    rng.set_stream((1 << 40) + number as u64);
    let condition = Condition::ALL[rng.random_range(0..Condition::ALL.len())];
    let part = if is_val(number) { SetPart::Middle } else { SetPart::First };
    let mut next = || ((part as u64) << 32) + u64::from(rng.random::<u32>());
    let seeds = ClipSeeds { body: next(), clothes: next(), camera: next(), motion: next(), voice: None };
    let scene = PeopleScene::new(condition, seeds, SECS, FrameRate::new(30, 1), None);
    let owners = PointOwners::new(&scene.actors[0]);
    let mut renderer = Renderer::new(scene.camera.size);
    let span = scene.n_frames / PICTURES;
    (0..PICTURES)
        .map(|k| {
            let frame_idx = k * span + rng.random_range(0..span);
            let quality =
                if condition == Condition::Compressed { rng.random_range(LOW_QUALITY) } else { jpeg::QUALITY };
            picture(&scene, &owners, &mut renderer, frame_idx, quality)
        })
        .collect()
}

fn picture(
    scene: &PeopleScene,
    owners: &PointOwners,
    renderer: &mut Renderer,
    frame_idx: usize,
    quality: i32,
) -> Result<LabelledPicture> {
    let (image, truth): (Image, _) = scene.frame(renderer, owners, frame_idx);
    let shown = person::shown(scene, renderer);
    let points = std::iter::once(person::points(&truth)).chain(std::iter::repeat_with(|| UNLABELLED));
    let people = shown.iter().zip(points).filter_map(|(shown, points)| {
        let shown = (*shown)?;
        Some(CocoPerson::new(0, 0, shown.bbox, shown.area, &points))
    });
    Ok(LabelledPicture {
        people: people.collect(),
        size: [image.width, image.height],
        jpeg: jpeg::encode_at(&image, quality)?,
    })
}
