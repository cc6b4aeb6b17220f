//! Unit tests of `orator_base::types::file_name`.

use orator_base::types::file_name::FileName;

#[test]
fn names_never_leave_their_folder() {
    for name in ["a", "train-clip-1-ef0a7ac8-0000.tar", "Vortrag über Öl.mp4", "a..b", &"x".repeat(255)] {
        let quoted = serde_json::to_string(name).unwrap();
        let read: FileName = serde_json::from_str(&quoted).unwrap();
        assert_eq!((&*read, serde_json::to_string(&read).unwrap()), (name, quoted));
    }
    for name in ["", ".", "..", ".hidden", "a/b", "/abs/x", "../../x", "a\\b", "a\nb", "a\0", &"x".repeat(256)] {
        let text = FileName::new(name).unwrap_err().to_string();
        assert!(text.contains("invalid file name") && text.len() < 500, "{text}");
        assert!(serde_json::from_str::<FileName>(&serde_json::to_string(name).unwrap()).is_err(), "{name:?}");
    }
}
