//! Transcripts: words with their times, as written by speech recognisers, aligners and subtitle programs; one file
//! per format except for tables. `transcript` selects the reader by file extension, decodes the text (`encoding`) and
//! notes problems with the times.

pub mod encoding;
pub mod json;
pub mod subtitles;
pub mod textgrid;
pub mod transcript;
pub mod word;

pub use transcript::{ENDINGS, Transcript, after_end};
pub use word::{Word, WordSource};
