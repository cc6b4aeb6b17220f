//! Initialisation and version of the ffmpeg libraries.

/// Starts ffmpeg once and silences its log lines, since every error is reported by this crate.
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
        "libavformat {}, libavcodec {}, libavfilter {}, libswscale {}, libswresample {}",
        dotted(ffmpeg_next::format::version()),
        dotted(ffmpeg_next::codec::version()),
        dotted(ffmpeg_next::filter::version()),
        dotted(scaling::version()),
        dotted(resampling::version())
    )
}
