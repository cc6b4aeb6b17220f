//! Files of the page by path below the token, with their content types.

const SCRIPT: &str = "text/javascript; charset=utf-8";

/// Path, content type and content of every file.
pub const ASSETS: [(&str, &str, &str); 15] = [
    ("/page.css", "text/css; charset=utf-8", include_str!("page/page.css")),
    ("/app.js", SCRIPT, include_str!("page/app.js")),
    ("/avatar.js", SCRIPT, include_str!("page/avatar.js")),
    ("/clip.js", SCRIPT, include_str!("page/clip.js")),
    ("/dataset.js", SCRIPT, include_str!("page/dataset.js")),
    ("/decisions.js", SCRIPT, include_str!("page/decisions.js")),
    ("/dom.js", SCRIPT, include_str!("page/dom.js")),
    ("/intervals.js", SCRIPT, include_str!("page/intervals.js")),
    ("/live.js", SCRIPT, include_str!("page/live.js")),
    ("/player.js", SCRIPT, include_str!("page/player.js")),
    ("/result.js", SCRIPT, include_str!("page/result.js")),
    ("/run.js", SCRIPT, include_str!("page/run.js")),
    ("/three.js", SCRIPT, include_str!("page/three.js")),
    ("/timeline.js", SCRIPT, include_str!("page/timeline.js")),
    ("/three.LICENSES.txt", "text/plain; charset=utf-8", include_str!("page/three.LICENSES.txt")),
];
