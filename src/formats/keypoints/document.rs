//! JSON keypoint files: OpenPose frames, MMPose results and inferencer lists, AlphaPose and COCO results,
//! COCO-WholeBody annotations. NaN, which Python writes into JSON, is read as a missing number.

use super::counted::{self, CountedPerson};
use super::entry::{ImageName, JsonEntry};
use super::found::FoundKeypoints;
use super::frames::number_of;
use anyhow::{Context, Result, bail, ensure};
use serde::Deserialize;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// Maximum number of persons per frame: each is compared with those of the previous frame.
const MAX_PERSONS: usize = 1000;

/// A file whose top level is an object.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct KeypointDocument {
    people: Option<Vec<JsonEntry>>,
    instance_info: Option<Vec<JsonEntry>>,
    annotations: Option<Vec<JsonEntry>>,
    images: Vec<AnnotatedImage>,
}

#[derive(Debug, Deserialize)]
struct AnnotatedImage {
    id: ImageName,
    #[serde(default)]
    file_name: String,
    #[serde(default)]
    width: u32,
    #[serde(default)]
    height: u32,
}

pub struct JsonPersons {
    /// Name of the program: `OpenPose`.
    pub program: &'static str,
    image_size: Option<[u32; 2]>,
    pub persons: FramePersons,
}

/// Persons, with or without frame numbers.
pub enum FramePersons {
    /// All persons in the single image of the file.
    Picture(Vec<JsonEntry>),
    /// All persons in each frame, by frame number.
    Frames(BTreeMap<u64, Vec<JsonEntry>>),
}

/// Parses the keypoints of a video from the bytes of a JSON file. Errors name line and column, or frame and person.
pub fn parse(bytes: &[u8]) -> Result<FoundKeypoints> {
    let JsonPersons { program, image_size, persons } = read_persons(bytes)?;
    let frames = match persons {
        FramePersons::Frames(frames) => frames,
        FramePersons::Picture(entries) => BTreeMap::from([(0, entries)]),
    };
    let mut found = from_frames(program, frames)?;
    found.image_size = image_size;
    Ok(found)
}

fn from_frames(program: &str, frames: BTreeMap<u64, Vec<JsonEntry>>) -> Result<FoundKeypoints> {
    let numbered = frames.into_iter().map(|(number, entries)| Ok((number, persons(number, &entries)?)));
    counted::of_persons(program, numbered.collect::<Result<_>>()?)
}

/// Converts the entries of frame `number` to persons.
///
/// # Errors
///
/// An entry is not a valid person, or there are more than 1000 persons.
pub fn persons(number: u64, entries: &[JsonEntry]) -> Result<Vec<CountedPerson>> {
    let n = entries.len();
    ensure!(n <= MAX_PERSONS, "frame {number} has {n} persons, expected at most {MAX_PERSONS}");
    let mut persons = Vec::with_capacity(n);
    for (at, entry) in entries.iter().enumerate() {
        let person = entry.person().map_err(|message| anyhow::anyhow!("frame {number}, person {at}: {message}"))?;
        persons.extend(person);
    }
    Ok(persons)
}

/// Parses the persons in the bytes of a JSON file.
pub fn read_persons(bytes: &[u8]) -> Result<JsonPersons> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let bytes = without_nan(bytes);
    let mut first_bytes = bytes.iter().filter(|byte| !byte.is_ascii_whitespace());
    match (first_bytes.next(), first_bytes.next()) {
        (Some(b'{'), _) => from_object(read(&bytes)?),
        (Some(b'['), Some(b'[')) => {
            let frames: Vec<Vec<JsonEntry>> = read(&bytes)?;
            Ok(JsonPersons::new("MMPose", FramePersons::Frames((0..).zip(frames).collect())))
        }
        (Some(b'['), _) => from_list(read(&bytes)?),
        _ => bail!("not JSON: expected {{ or [ at the start"),
    }
}

impl JsonPersons {
    fn new(program: &'static str, persons: FramePersons) -> Self {
        Self { program, image_size: None, persons }
    }
}

fn read<'de, T: Deserialize<'de>>(bytes: &'de [u8]) -> Result<T> {
    serde_json::from_slice(bytes).context("the JSON is truncated, damaged or of another format")
}

fn from_object(object: KeypointDocument) -> Result<JsonPersons> {
    let KeypointDocument { people, instance_info, annotations, images } = object;
    if let Some(people) = people {
        if let Some(at) = people.iter().position(|person| !person.has_body()) {
            bail!("person {at} of `people` has no `pose_keypoints_2d` (`pose_keypoints` before OpenPose 1.3)");
        }
        return Ok(JsonPersons::new("OpenPose", FramePersons::Picture(people)));
    }
    if let Some(instances) = instance_info {
        return Ok(JsonPersons { program: "MMPose", ..from_list(instances)? });
    }
    let Some(annotations) = annotations else {
        bail!(
            "expected `people` (OpenPose), `instance_info` (MMPose), `annotations` and \
             `images` (COCO-WholeBody) or a list of persons (AlphaPose, MMPose)"
        );
    };
    let numbers = annotated_numbers(&images);
    let mut frames: BTreeMap<u64, Vec<JsonEntry>> = numbers.values().map(|number| (*number, Vec::new())).collect();
    for (at, entry) in annotations.into_iter().enumerate() {
        let number = match &entry.image_id {
            Some(name) if images.is_empty() => number_of_image(name)?,
            Some(name) => *numbers
                .get(name)
                .with_context(|| format!("annotation {at}: `images` has no image {}", format_name(name)))?,
            None => bail!("annotation {at}: the key image_id is missing"),
        };
        frames.entry(number).or_default().push(entry);
    }
    let size = images.iter().map(|image| [image.width, image.height]).find(|size| size.iter().all(|px| *px > 0));
    Ok(JsonPersons { program: "COCO-WholeBody", image_size: size, persons: FramePersons::Frames(frames) })
}

/// Frame number of each image: the digits of its file name if these are unique, otherwise its index in the list.
fn annotated_numbers(images: &[AnnotatedImage]) -> BTreeMap<&ImageName, u64> {
    let by_name: Option<Vec<u64>> = images.iter().map(|image| number_of(&image.file_name)).collect();
    let are_unique = |numbers: &Vec<u64>| numbers.iter().collect::<BTreeSet<_>>().len() == numbers.len();
    let numbers = by_name.filter(are_unique).unwrap_or_else(|| (0..images.len() as u64).collect());
    images.iter().map(|image| &image.id).zip(numbers).collect()
}

fn from_list(entries: Vec<JsonEntry>) -> Result<JsonPersons> {
    if entries.iter().any(|entry| entry.instances.is_some()) {
        let mut frames = BTreeMap::new();
        for (at, entry) in (0..).zip(entries) {
            let number = entry.frame_id.unwrap_or(at);
            let before = frames.insert(number, entry.instances.unwrap_or_default());
            ensure!(before.is_none(), "duplicate frame_id {number}: expected the frames of one video");
        }
        return Ok(JsonPersons::new("MMPose", FramePersons::Frames(frames)));
    }
    if entries.iter().all(|entry| entry.image_id.is_none()) {
        return Ok(JsonPersons::new("MMPose", FramePersons::Picture(entries)));
    }
    let mut frames: BTreeMap<u64, Vec<JsonEntry>> = BTreeMap::new();
    for (at, entry) in entries.into_iter().enumerate() {
        let Some(name) = &entry.image_id else { bail!("person {at} of the list: the key image_id is missing") };
        frames.entry(number_of_image(name)?).or_default().push(entry);
    }
    Ok(JsonPersons::new("AlphaPose", FramePersons::Frames(frames)))
}

fn number_of_image(name: &ImageName) -> Result<u64> {
    match name {
        ImageName::Number(number) => Ok(*number),
        ImageName::Name(text) => {
            number_of(text).with_context(|| format!("image_id {text:?} has no digits: expected the frame number in it"))
        }
    }
}

fn format_name(name: &ImageName) -> String {
    match name {
        ImageName::Number(number) => number.to_string(),
        ImageName::Name(text) => format!("{text:?}"),
    }
}

/// The JSON with Python's NaN and Infinity replaced by `null`.
fn without_nan(bytes: &[u8]) -> Cow<'_, [u8]> {
    let text = String::from_utf8_lossy(bytes);
    if !text.contains("NaN") && !text.contains("Infinity") {
        return Cow::Borrowed(bytes);
    }
    let text = text.replace("-Infinity", "null").replace("Infinity", "null").replace("NaN", "null");
    Cow::Owned(text.into_bytes())
}
