//! Unit tests of `orator_formats::checkpoint`.

use orator_formats::checkpoint::{facts, list, path, prune};

#[test]
fn prune_retains_the_newest() -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    for step in [100, 20, 3000] {
        std::fs::write(path(folder.path(), step), b"x")?;
    }
    std::fs::write(folder.path().join("best.safetensors"), b"x")?;
    prune(folder.path(), 2)?;
    let steps: Vec<usize> = list(folder.path())?.into_iter().map(|(step, _)| step).collect();
    assert_eq!(steps, [100, 3000]);
    assert!(list(&folder.path().join("missing"))?.is_empty());
    assert!(facts(&path(folder.path(), 100)).is_err());
    Ok(())
}
