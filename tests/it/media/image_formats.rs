//! Videos that need image processing: a changing image size, HDR, interlacing. Plain videos are not changed.

use crate::fixtures::clips::{ffmpeg, number_of, write_numbered, write_sized};
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::image::{Image, PictureOptions};
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_formats::media_json::MediaInfo;
use orator_formats::timeline_npz::Timeline;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::opencv::png;
use orator_pipeline::extract::ExtractStage;
use orator_pipeline::extract::survey::{PictureSurvey, comb_share};
use orator_test_support::project::files_under;
use orator_test_support::skip::real_data;
use std::path::Path;

const DATASET: FrameRate = FrameRate::new(15, 1);

fn extract(video: &Path) -> (MediaInfo, Timeline, String) {
    let out = tempfile::tempdir().unwrap();
    let unit = Unit { speaker: "host".into(), video: "clip".into(), source: video.to_owned() };
    let report = ExtractStage::new(&config::ExtractConfig::default()).run(&unit, out.path(), &Silent).unwrap();
    let media = MediaInfo::read(&out.path().join("media.json")).unwrap();
    (media, Timeline::read(&out.path().join("timeline.npz")).unwrap(), report.line)
}

#[test]
fn images_of_another_size_in_a_file_are_scaled_to_the_first_size() {
    let dir = tempfile::tempdir().unwrap();
    let segments = [("first", [128, 64]), ("scaled", [256, 128]), ("square", [128, 128])];
    for (k, (name, size)) in segments.into_iter().enumerate() {
        write_sized(dir.path(), &format!("{name}.mp4"), 30, FrameRate::new(30, 1), size, None);
        let options = format!("-c:v libx264 -crf 10 -bf 0 -muxdelay 0 -muxpreload 0 -output_ts_offset {k}");
        if !ffmpeg(dir.path(), &format!("-i {name}.mp4 {options} {name}.ts")) {
            return;
        }
    }
    let joined = |names: &[&str]| {
        let bytes = names.iter().flat_map(|name| std::fs::read(dir.path().join(format!("{name}.ts"))).unwrap());
        let path = dir.path().join(format!("{}.ts", names.join("-")));
        std::fs::write(&path, bytes.collect::<Vec<u8>>()).unwrap();
        path
    };
    let path = joined(&["first", "scaled", "square"]);
    let frames: Vec<Image> = FrameReader::open(&path, DATASET).unwrap().map(|frame| frame.unwrap().image).collect();
    assert!((44..=46).contains(&frames.len()), "{}", frames.len());
    assert!(frames.iter().all(|image| [image.width, image.height] == [128, 64]));
    let middle = |image: &Image| {
        let cut = orator_base::types::image::PixelArea { x: 32, y: 0, width: 64, height: 64 };
        number_of(&image.cropped(cut))
    };
    for n in 0..15 {
        let numbers = [number_of(&frames[n]), number_of(&frames[15 + n]), middle(&frames[30 + n.min(13)])];
        assert_eq!(numbers, [2 * n, 2 * n, 2 * n.min(13)], "frame {n}");
        assert!(frames[30 + n.min(13)].pixel(10, 10).iter().all(|value| *value == 0));
    }
    let (media, timeline, line) = extract(&path);
    assert_eq!((media.n_resizes, media.image_size, media.damage), (2, [128, 64], None));
    assert!(line.contains("the image size changes 2 times"), "{line}");
    assert!(timeline.restart[15] && timeline.restart[30], "{:?}", timeline.restart);
    // The first change preserves the aspect ratio, so the image content does not move.
    assert!(timeline.shot_score[15] < 0.2 && timeline.shot_score[30] == 1.0, "{:?}", timeline.shot_score);
    // The first size is used even if it is the smaller one.
    let (media, ..) = extract(&joined(&["square", "scaled"]));
    assert_eq!(media.image_size, [128, 128]);
}

/// An image of six colour patches, and their colours.
fn patches() -> (Image, [[u8; 3]; 6]) {
    let colours = [[16, 16, 16], [64, 64, 64], [128, 128, 128], [190, 140, 115], [60, 90, 170], [225, 225, 225]];
    let mut image = Image::filled(192, 128, [0; 3]);
    for (at, pixel) in image.data.as_chunks_mut::<3>().0.iter_mut().enumerate() {
        *pixel = colours[at % 192 / 64 + 3 * (at / 192 / 64)];
    }
    (image, colours)
}

#[test]
fn hdr_images_are_tone_mapped_to_their_sdr_source() {
    let dir = tempfile::tempdir().unwrap();
    let (image, colours) = patches();
    png::write(&dir.path().join("patches.png"), &image).unwrap();
    for (transfer, name) in [("smpte2084", "PQ"), ("arib-std-b67", "HLG")] {
        let to_hdr = format!(
            "format=gbrp,zscale=tin=bt709:min=gbr:pin=bt709:rin=full:t={transfer}:m=2020_ncl:p=2020:r=limited:npl=203,\
             format=yuv420p10le"
        );
        let tags =
            format!("log-level=none:colorprim=bt2020:transfer={transfer}:colormatrix=bt2020nc:range=limited:crf=8");
        let args =
            format!("-loop 1 -t 2 -r 15 -i patches.png -vf {to_hdr} -c:v libx265 -x265-params {tags} {name}.mp4");
        if !ffmpeg(dir.path(), &args) {
            continue;
        }
        let path = dir.path().join(format!("{name}.mp4"));
        let mut reader = FrameReader::open(&path, DATASET).unwrap();
        assert_eq!(reader.hdr(), Some(name));
        let frame = reader.next().unwrap().unwrap().image;
        for (k, colour) in colours.iter().enumerate() {
            let found = frame.pixel(64 * (k % 3) + 32, 64 * (k / 3) + 32);
            eprintln!("{name}: {colour:?} is read as {found:?}");
            assert!(found.iter().zip(colour).all(|(a, b)| a.abs_diff(*b) <= 4), "{name}: {colour:?} became {found:?}");
        }
        let (media, _, line) = extract(&path);
        assert_eq!(media.hdr.as_deref(), Some(name));
        assert!(line.contains(&format!("HDR ({name}): tone-mapped")), "{line}");
    }
}

/// Mean share of pixels with combing artefacts over a clip at 25 fps.
fn mean_comb_share(path: &Path, pictures: PictureOptions) -> f64 {
    let reader = FrameReader::open(path, FrameRate::new(25, 1)).unwrap().with_options(pictures);
    let frames: Vec<Image> = reader.map(|frame| frame.unwrap().image).collect();
    let shares: Vec<f64> = frames.windows(2).map(|pair| comb_share(&pair[0], &pair[1])).collect();
    shares.iter().sum::<f64>() / shares.len() as f64
}

#[test]
fn interlacing_is_detected_and_combing_is_removed() {
    let dir = tempfile::tempdir().unwrap();
    // A disc in front of a textured wall that moves 6 px sideways per 1/50 s.
    let disc = "geq=lum='if(lt(hypot(mod(6*N,W)-X,Y-H/2),60),220,60+20*sin(X/9)*cos(Y/7))':cb=128:cr=128";
    let drawn = format!("-f lavfi -i color=gray:s=480x320:r=50:d=2.4 -vf {disc} -c:v ffv1 drawn.mkv");
    if !ffmpeg(dir.path(), &drawn) {
        return;
    }
    let interlaced = PictureOptions::default();
    let deinterlaced = PictureOptions { deinterlace: true, ..interlaced };
    for (name, fields, codec) in [
        ("flagged.mp4", "tinterlace=interleave_top", "libx264 -flags +ildct+ilme -crf 12"),
        ("bottom.mpg", "tinterlace=interleave_bottom", "mpeg2video -flags +ildct+ilme -q:v 2 -top 0"),
        ("silent.mp4", "tinterlace=interleave_top,setfield=prog", "libx264 -crf 12"),
        ("deep.mkv", "tinterlace=interleave_top,format=yuv422p10le", "ffv1"),
    ] {
        if !ffmpeg(dir.path(), &format!("-i drawn.mkv -vf {fields} -c:v {codec} {name}")) {
            continue;
        }
        let path = dir.path().join(name);
        let [before, after] = [interlaced, deinterlaced].map(|pictures| mean_comb_share(&path, pictures));
        eprintln!("{name}: combs {before:.5} before, {after:.6} after");
        assert!(before > 0.001 && after < 0.05 * before, "{name}: {before} to {after}");
        let (media, _, line) = extract(&path);
        assert!(media.pictures.deinterlace && line.contains("interlaced: deinterlaced"), "{name}: {line}");
        // Every frame shows the disc at the time of the earlier field.
        let reader = FrameReader::open(&path, FrameRate::new(25, 1)).unwrap().with_options(deinterlaced);
        for frame in reader.map(Result::unwrap).skip(10).take(40) {
            let row = |x: usize| frame.image.pixel(x, 160)[1] > 140;
            let lit: Vec<usize> = (0..480).filter(|x| row(*x)).collect();
            let centre = lit.iter().sum::<usize>() as f64 / lit.len() as f64;
            let truth = f64::from((12 * frame.frame_idx as u32) % 480);
            if (70.0..410.0).contains(&truth) {
                assert!((centre - truth).abs() < 1.5, "{name} {}: {centre}, expected {truth}", frame.frame_idx);
            }
        }
    }
    if ffmpeg(dir.path(), "-i drawn.mkv -c:v libx264 -crf 12 plain.mp4") {
        let (media, _, line) = extract(&dir.path().join("plain.mp4"));
        assert!(media.pictures.is_plain() && media.active_area.is_none() && !line.contains(';'), "{line}");
    }
}

#[test]
fn plain_clips_need_no_image_processing() {
    let dir = tempfile::tempdir().unwrap();
    let plain = write_numbered(dir.path(), "in.mp4", 60, FrameRate::new(30, 1), None);
    extract(&plain);
    let text = std::fs::read_to_string({
        let out = dir.path().join("out");
        std::fs::create_dir(&out).unwrap();
        let unit = Unit { speaker: "host".into(), video: "clip".into(), source: plain };
        ExtractStage::new(&config::ExtractConfig::default()).run(&unit, &out, &Silent).unwrap();
        out.join("media.json")
    })
    .unwrap();
    for key in ["pictures", "active_area", "hdr", "n_resizes", "audio_tracks"] {
        assert!(!text.contains(key), "{text}");
    }
}

#[test]
fn real_clips_are_neither_interlaced_nor_letterboxed() {
    let Some(videos) = real_data("data/videos") else { return };
    for (name, video) in
        files_under(&videos).iter().filter(|(name, _)| name.ends_with(".mp4") || name.ends_with(".mkv"))
    {
        let mut survey = PictureSurvey::new(DATASET);
        let mut reader = FrameReader::open_with(video, DATASET, 0).unwrap();
        while let Some(time) = reader.advance().unwrap() {
            if !time.repeated {
                let picture = survey.needs_picture().then(|| reader.picture(None).unwrap());
                survey.push(picture, reader.is_flagged_interlaced());
            }
        }
        let (combs, area) = (survey.comb_share(), survey.active_area());
        eprintln!("{name}: combs {combs:.7}, {area:?}");
        assert!(!survey.is_interlaced() && area.is_none(), "{name}: combs {combs}, {area:?}");
    }
}
