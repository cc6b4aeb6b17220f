//! Version of the OpenCV libraries.

/// Version of the OpenCV library linked.
pub fn version() -> String {
    use opencv::core::{get_version_major, get_version_minor, get_version_revision};
    format!("{}.{}.{}", get_version_major(), get_version_minor(), get_version_revision())
}
