//! Writer of ELAN annotation files (EAF 3.0, mpi.nl/tools/elan/EAFv3.0.xsd): tiers of annotations with times. Bytes are
//! the same for the same annotations, so the date is a constant.

use orator_base::text::escape;
use std::fmt::Write as _;

/// Annotation from one time to another, seconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Annotation {
    pub start_secs: f64,
    pub end_secs: f64,
    /// Text; characters that XML does not allow are dropped.
    pub value: String,
}

/// Named tier. Annotations of a tier do not overlap in ELAN: a later one starts where the previous one ends, at least
/// 1 ms later.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AnnotationTier {
    pub name: String,
    pub annotations: Vec<Annotation>,
}

/// Types of file by extension, for players; others are `unknown`.
const MIME_TYPES: [(&str, &str); 4] =
    [("mp4", "video/mp4"), ("mov", "video/quicktime"), ("mpg", "video/mpeg"), ("wav", "audio/x-wav")];
const HEADER: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <ANNOTATION_DOCUMENT AUTHOR=\"orator\" DATE=\"2000-01-01T00:00:00+00:00\" FORMAT=\"3.0\" VERSION=\"3.0\" \
    xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
    xsi:noNamespaceSchemaLocation=\"http://www.mpi.nl/tools/elan/EAFv3.0.xsd\">\n";
const FOOTER: &str = "    <LINGUISTIC_TYPE GRAPHIC_REFERENCES=\"false\" LINGUISTIC_TYPE_ID=\"default-lt\" \
    TIME_ALIGNABLE=\"true\"/>\n</ANNOTATION_DOCUMENT>\n";

/// Contents of an `.eaf` file for the media file at `media`, a path relative to the `.eaf` file with `/` between
/// folders. Times are rounded to milliseconds; annotations are sorted by start.
pub fn write(media: &str, tiers: &[AnnotationTier]) -> String {
    let spans: Vec<Vec<(u64, u64, &str)>> = tiers.iter().map(spans).collect();
    // Annotations share no time slot: ELAN moves all annotations of a slot together.
    let mut slots: Vec<(u64, usize)> = spans.iter().flatten().flat_map(|span| [span.0, span.1]).zip(0..).collect();
    slots.sort_unstable();
    let mut slot_ids = vec![0; slots.len()];
    slots.iter().zip(1..).for_each(|((_, slot), id)| slot_ids[*slot] = id);
    let extension = media.rsplit_once('.').map_or("", |(_, extension)| extension).to_ascii_lowercase();
    let mime = MIME_TYPES.iter().find(|(known, _)| *known == extension).map_or("unknown", |(_, mime)| mime);
    let media = encoded(&if media.starts_with("../") { media.to_owned() } else { format!("./{media}") });
    let n_annotations = slots.len() / 2;
    let mut text = HEADER.to_owned();
    let _ = write!(
        text,
        "    <HEADER MEDIA_FILE=\"\" TIME_UNITS=\"milliseconds\">\n        <MEDIA_DESCRIPTOR MEDIA_URL=\"{media}\" \
         MIME_TYPE=\"{mime}\" RELATIVE_MEDIA_URL=\"{media}\"/>\n        <PROPERTY \
         NAME=\"lastUsedAnnotationId\">{n_annotations}</PROPERTY>\n    </HEADER>\n    <TIME_ORDER>\n"
    );
    for ((ms, _), n) in slots.iter().zip(1..) {
        let _ = writeln!(text, "        <TIME_SLOT TIME_SLOT_ID=\"ts{n}\" TIME_VALUE=\"{ms}\"/>");
    }
    text.push_str("    </TIME_ORDER>\n");
    let mut n = 0;
    for (tier, spans) in tiers.iter().zip(&spans) {
        let _ = writeln!(text, "    <TIER LINGUISTIC_TYPE_REF=\"default-lt\" TIER_ID=\"{}\">", encoded(&tier.name));
        for (.., value) in spans {
            let [start, end] = [slot_ids[2 * n], slot_ids[2 * n + 1]];
            n += 1;
            let _ = write!(text, "        <ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID=\"a{n}\" ");
            let _ = write!(text, "TIME_SLOT_REF1=\"ts{start}\" TIME_SLOT_REF2=\"ts{end}\"><ANNOTATION_VALUE>");
            let _ = writeln!(text, "{}</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>", encoded(value));
        }
        text.push_str("    </TIER>\n");
    }
    text + FOOTER
}

/// Start and end in milliseconds and value of each annotation, without overlap.
fn spans(tier: &AnnotationTier) -> Vec<(u64, u64, &str)> {
    let ms = |secs: f64| (1000.0 * secs.max(0.0)).round() as u64;
    let mut sorted: Vec<&Annotation> = tier.annotations.iter().collect();
    sorted.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
    let mut until = 0;
    let mut spans = Vec::with_capacity(sorted.len());
    for annotation in sorted {
        let start = ms(annotation.start_secs).max(until);
        until = ms(annotation.end_secs).max(start + 1);
        spans.push((start, until, annotation.value.as_str()));
    }
    spans
}

/// Text for XML 1.0 elements and attributes, without the characters that XML does not allow.
fn encoded(text: &str) -> String {
    let blank = |c: char| if matches!(c, '\t' | '\n' | '\r') { ' ' } else { c };
    let allowed = text.chars().map(blank).filter(|c| !matches!(c, '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}'));
    escape(&allowed.collect::<String>())
}
