//! Transcripts: words with their times, as speech recognisers, aligners and subtitles write them, one format a file
//! but for tables. `transcript` reads a file by its ending, decodes its text (`encoding`), and notes what is wrong with its times.

pub mod encoding;
pub mod json;
pub mod subtitles;
pub mod textgrid;
pub mod transcript;
pub mod word;

pub use transcript::{ENDINGS, Transcript, after_end};
pub use word::{Word, WordSource};
