//! Tests of `orator_formats::transcript::encoding`.

use orator_formats::transcript::encoding::text_of;

#[test]
fn encodings_are_detected_and_others_rejected_with_their_line() {
    let utf16 = |swap: bool| {
        let units = "\u{feff}sö\n".encode_utf16();
        let bytes = units.map(|unit| if swap { unit.to_be_bytes() } else { unit.to_le_bytes() });
        bytes.collect::<Vec<_>>().concat()
    };
    for bytes in [utf16(false), utf16(true), "sö\n".into(), "\u{feff}sö\n".into()] {
        assert_eq!(text_of(&bytes).unwrap(), "sö\n");
    }
    assert!(text_of(b"so\nsch\xf6n").unwrap_err().to_string().starts_with("line 2: byte 0xf6"));
    assert!(text_of(b"s\0o\0\n\0").unwrap_err().to_string().contains("UTF-16"));
    assert!(text_of(b"\xff\xfes").is_err());
    assert!(text_of(b"\xff\xfe\x00\xd8\x00\x00").unwrap_err().to_string().starts_with("line 1"));
}
