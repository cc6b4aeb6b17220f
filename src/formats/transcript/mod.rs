//! Transcripts: words with their times, as written by speech recognisers, aligners and subtitle programs; one file
//! per format except for tables. `transcript` selects the reader by file extension, decodes the text (`encoding`) and
//! notes problems with the times; `choice` selects one of several files; `write` writes recognised words.

pub mod choice;
mod collector;
pub mod encoding;
pub mod json;
mod json_values;
pub mod marks;
pub mod subtitles;
pub mod textgrid;
pub mod tiers;
pub mod transcript;
pub mod word;
pub mod write;

pub use choice::TranscriptChoice;
pub use transcript::{ENDINGS, Transcript, after_end};
pub use word::{Word, WordSource};
pub use write::{SpokenSegment, TranscriptFormat};
