//! The body network: it learns a few pictures by heart, goes on where it was stopped, and its ONNX file gives what it
//! gives.

use crate::fixtures::skip::skip;
use candle_core::{Device, Tensor};
use orator::external::ffmpeg::jpeg;
use orator::external::onnx::{Manifest, Model, ModelEntry, Port, Runtime, sha256_of};
use orator::formats::coco_wholebody::{CocoImage, CocoLabels, CocoPerson, PersonPoints, PointLabel, labelled};
use orator::nn::params::Params;
use orator::nn::pose::body::{BodyNet, BodyNetConfig};
use orator::stage::progress::Silent;
use orator::train::pose::body::BodyNetTask;
use orator::train::pose::{export, measure, people};
use orator::train::supervised::{Schedule, train};
use orator::types::image::Image;
use orator::types::pose2d::{N_BODY, N_HAND};
use std::path::Path;

const TINY: BodyNetConfig = BodyNetConfig { size: [64, 48], widths: [8, 12, 16, 16], n_blocks: [1, 0, 0] };

/// Four pictures of a bright cross on grey, whose middle and ends are points; `train` and `val` are the same.
fn labelled_set(dir: &Path) {
    let mut labels = CocoLabels::new("crosses", "cc0-1.0");
    std::fs::create_dir_all(dir.join("images")).unwrap();
    for id in 1..=4u64 {
        let (x, y) = (30 + 7 * id as usize, 60 - 5 * id as usize);
        let mut image = Image::filled(96, 96, [90; 3]);
        for (px, py, colour) in (0..20).flat_map(|k| {
            [
                (x + k, y, [250, 40, 40]),
                (x - k, y, [40, 250, 40]),
                (x, y + k, [40, 40, 250]),
                (x, y - k, [250, 250, 40]),
            ]
        }) {
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                image.data[3 * ((py + dy) * 96 + px + dx)..][..3].copy_from_slice(&colour);
            }
        }
        let file_name = format!("{id:06}.jpg");
        std::fs::write(dir.join("images").join(&file_name), jpeg::encode(&image).unwrap()).unwrap();
        labels.images.push(CocoImage { id, file_name, width: 96, height: 96, license: 1 });
        let mut points = PersonPoints { body: [[0.0; 3]; N_BODY], hands: [[[0.0; 3]; N_HAND]; 2] };
        let [x, y] = [x as f64, y as f64];
        for (point, place) in
            [(0, [x, y]), (5, [x + 19.0, y]), (6, [x - 19.0, y]), (11, [x, y + 19.0]), (12, [x, y + 19.0])]
        {
            points.body[point] = labelled(place, PointLabel::Seen);
        }
        let bbox = [x - 20.0, y - 20.0, 40.0, 40.0];
        labels.annotations.push(CocoPerson::new(id, id, bbox, 1600.0, &points));
    }
    labels.write(dir, "train").unwrap();
    labels.write(dir, "val").unwrap();
}

#[test]
fn a_tiny_network_learns_four_pictures_by_heart() {
    let dir = tempfile::tempdir().unwrap();
    labelled_set(dir.path());
    let task = || {
        let [learnt, held_out] = ["train", "val"].map(|part| people::read(dir.path(), part).unwrap());
        BodyNetTask::new(learnt, held_out, &TINY, 5).unwrap()
    };
    let schedule =
        Schedule { steps: 200, batch: 8, learning_rate: 1e-2, seed: 3, checkpoint_every: 50, started_from: None };
    let out = dir.path().join("body.safetensors");
    let mut trained = task();
    let lines = train(&mut trained, &schedule, &out, &Silent).unwrap();
    assert!(lines[0].starts_with("4 people"), "{}", lines[0]);
    let people = people::read(dir.path(), "val").unwrap();
    let mean = |points: &[[[f64; 3]; N_BODY]]| {
        people.iter().zip(points).map(|(person, points)| measure::similarity(person, points)).sum::<f64>() / 4.0
    };
    let (before, after) = (mean(&task().predict(&people).unwrap()), mean(&trained.predict(&people).unwrap()));
    assert!(after > 0.6 && before < 0.1, "similarity {before} before, {after} after");

    std::fs::remove_file(dir.path().join("images/000002.jpg")).unwrap();
    let text = format!("{:#}", train(&mut task(), &schedule, &dir.path().join("b"), &Silent).unwrap_err());
    assert!(text.contains("000002.jpg"), "{text}");
}

#[test]
fn the_onnx_file_gives_what_the_network_gives() {
    let config = BodyNetConfig { size: [128, 96], ..TINY };
    let mut params = Params::new(7);
    let net = BodyNet::new(&mut params, &config).unwrap();
    let n = 3 * 128 * 96;
    let picture: Vec<f32> = (0..n).map(|k| ((k * 37 % 101) as f32 / 50.0 - 1.0) * (k as f32 * 0.01).sin()).collect();
    let x = Tensor::from_vec(picture.clone(), (1, 128, 96, 3), &Device::Cpu).unwrap();
    // Running statistics that are not those of the start.
    for step in 0..5 {
        net.forward(&(&x * (1.0 + f64::from(step))).unwrap(), true).unwrap();
    }
    let wanted = net.forward(&x, false).unwrap().permute((0, 3, 1, 2)).unwrap().flatten_all().unwrap();
    let wanted = wanted.to_vec1::<f32>().unwrap();

    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("own.onnx");
    std::fs::write(&file, export::onnx(&net, params.n_parameters()).unwrap()).unwrap();
    let manifest = Manifest::builtin().unwrap();
    let like = manifest.get(export::LIKE).unwrap();
    let port = |port: &Port| (port.name.clone(), port.shape.clone());
    assert_eq!(port(&like.inputs[0]), ("image".to_owned(), vec![1, 3, 128, 96]));
    let entry = ModelEntry { file: "own.onnx".to_owned(), sha256: sha256_of(&file).unwrap(), ..like.clone() };
    let runtime = match Runtime::load(Path::new(""), dir.path()) {
        Ok(runtime) => runtime,
        Err(error) => return skip(&format!("{error:#}")),
    };
    let mut model = Model::open(&runtime, &entry, dir.path()).unwrap();
    let planes = (0..3).flat_map(|c| picture.iter().skip(c).step_by(3));
    model.input_mut().iter_mut().zip(planes).for_each(|(to, from)| *to = *from);
    let outputs = model.run().unwrap();
    let (shape, found) = outputs.floats("heatmap").unwrap();
    assert_eq!(shape, [1, 17, 32, 24]);
    let off = found.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    let most = wanted.iter().fold(0.0f32, |most, v| most.max(v.abs()));
    assert!(off < 1e-4 && most > 0.1, "{off} of {most}");
}
