//! Unit tests of `orator_avatar::animate::export::file`.

use orator_avatar::animate::export::file::ExportFormat;
use std::path::Path;

#[test]
fn the_extension_selects_the_format() {
    assert_eq!(ExportFormat::from_path(Path::new("a/b.BVH")).unwrap(), ExportFormat::Bvh);
    assert_eq!(ExportFormat::from_path(Path::new("a.Glb")).unwrap(), ExportFormat::Glb);
    assert_eq!(ExportFormat::from_path(Path::new("a.b/c.npy")).unwrap(), ExportFormat::Npy);
    assert_eq!(ExportFormat::from_path(Path::new("a.SMPLX.npz")).unwrap(), ExportFormat::Smplx);
    assert_eq!(ExportFormat::from_path(Path::new("smplx.npz")).unwrap(), ExportFormat::Npz);
    for wrong in ["a.mov", "mp4", "a", ""] {
        assert!(ExportFormat::from_path(Path::new(wrong)).unwrap_err().to_string().contains(".vrma or .mp4"));
    }
}
