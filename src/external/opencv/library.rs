//! The only room that knows OpenCV: warps and letterboxes, pixels to tensors, heat-map filters, drawing; and PNG files.

/// Version of the OpenCV library linked.
pub fn version() -> String {
    use opencv::core::{get_version_major, get_version_minor, get_version_revision};
    format!("{}.{}.{}", get_version_major(), get_version_minor(), get_version_revision())
}
