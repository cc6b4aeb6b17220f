//! Excerpts of videos.

use anyhow::Result;
use orator_base::types::image::Image;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::probe::probe;
use orator_media::ffmpeg::write::encode::VideoWriter;
use orator_media::ffmpeg::write::excerpt::copy;

#[test]
fn excerpt_has_the_images_and_audio_of_its_range() {
    let dir = tempfile::tempdir().unwrap();
    let (full, part, fps) = (dir.path().join("full.mp4"), dir.path().join("part.mkv"), FrameRate::new(25, 1));
    let sound = Sound { samples: (0..16_000 * 30).map(|i| ((i as f32) * 0.1).sin() * 0.5).collect(), rate: 16_000 };
    let mut video = VideoWriter::create(&full, 64, 48, fps, Some(&sound)).unwrap();
    (0..25 * 30).for_each(|i| video.push(&Image::filled(64, 48, [(i / 4) as u8; 3])).unwrap());
    video.finish().unwrap();
    let secs = copy(&full, &part, 14.0, 5.0).unwrap();
    assert!((4.9..5.2).contains(&secs), "{secs}");
    let media = probe(&part).unwrap();
    assert!(media.audio.is_some() && media.video.unwrap().coded_size == [64, 48]);
    let frames: Vec<_> = FrameReader::open(&part, FrameRate::new(5, 1)).unwrap().map(Result::unwrap).collect();
    // The excerpt starts at most one group of pictures earlier.
    let start_secs = f64::from(frames[0].image.data[0]) * 4.0 / 25.0;
    assert!((3.0..14.5).contains(&start_secs) && (24..=27).contains(&frames.len()), "{start_secs} {}", frames.len());
    assert!(copy(&dir.path().join("no.mp4"), &part, 0.0, 5.0).is_err());
}
