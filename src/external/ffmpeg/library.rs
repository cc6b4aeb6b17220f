//! The only room that knows ffmpeg. `probe` says what a file holds, `frames` streams its pictures at a chosen rate by
//! presentation time (`ahead`: beside other work), `audio` its sound on the same clock (`sound_stream`: as it is asked for), `encode` writes mp4. Beneath
//! them: `source` opens files and names what is wrong with them, `decode` turns one stream into decoded frames, `picture`
//! makes those upright RGB.
//!
//! One clock for all: time 0 is the first picture that decodes (`origin`); a file without pictures starts with its first
//! sample.

/// Starts ffmpeg, once; its own log lines are kept off the terminal, since every error is told by this room.
pub(crate) fn init() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        // Registers nothing since ffmpeg 4 and cannot fail there; a failure would show at the first file opened.
        let _ = ffmpeg_next::init();
        ffmpeg_next::log::set_level(ffmpeg_next::log::Level::Quiet);
    });
}

/// Versions of the ffmpeg libraries linked, for instance `libavformat 59.27.100, libavcodec 59.37.100, ...`.
pub fn version() -> String {
    use ffmpeg_next::software::{resampling, scaling};
    let dotted = |v: u32| format!("{}.{}.{}", v >> 16, (v >> 8) & 255, v & 255);
    format!(
        "libavformat {}, libavcodec {}, libswscale {}, libswresample {}",
        dotted(ffmpeg_next::format::version()),
        dotted(ffmpeg_next::codec::version()),
        dotted(scaling::version()),
        dotted(resampling::version())
    )
}
