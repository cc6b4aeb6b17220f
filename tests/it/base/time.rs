//! Frame rates and times.

use orator_base::types::time::FrameRate;

#[test]
fn frames_and_seconds_agree() {
    let ntsc = FrameRate::new(30_000, 1_001);
    assert_eq!(ntsc.frames_in(ntsc.secs(600)), 600);
    assert_eq!(FrameRate::new(15, 1).frames_in(2.01), 31);
    assert_eq!(FrameRate::new(0, 0).per_sec(), 1.0);
}

#[test]
fn a_rate_is_in_lowest_terms() {
    assert_eq!(FrameRate::new(30, 2), FrameRate::new(15, 1));
    assert_eq!(FrameRate::new(29_970, 1000), FrameRate { num: 2997, den: 100 });
    assert_eq!(FrameRate::new(30_000, 1001), FrameRate { num: 30_000, den: 1001 });
}

#[test]
fn rates_parse_from_common_notations() {
    for (text, num, den) in [
        ("15", 15, 1),
        (" 25.0", 25, 1),
        ("29.97", 30_000, 1001),
        ("29.97002997", 30_000, 1001),
        ("23.976", 24_000, 1001),
        ("59.94 fps", 60_000, 1001),
        ("30000/1001", 30_000, 1001),
        ("60/2", 30, 1),
        ("12.5", 25, 2),
        ("240.5", 481, 2),
    ] {
        assert_eq!(text.parse(), Ok(FrameRate::new(num, den)), "{text}");
    }
    for wrong in ["", "0", "-3", "1/0", "0/1", "nan", "inf", "1e9", "fast", "1001", "15/", "fps"] {
        assert!(wrong.parse::<FrameRate>().is_err(), "{wrong}");
    }
}

#[test]
fn a_stored_rate_with_a_zero_part_is_rejected() {
    let read = |text: &str| serde_json::from_str::<FrameRate>(text).map_err(|error| error.to_string());
    for (text, rate) in [("{\"num\":15,\"den\":0}", "15/0"), ("{\"num\":0,\"den\":1}", "0/1")] {
        assert!(read(text).unwrap_err().starts_with(&format!("invalid frame rate {rate}")), "{text}");
    }
    let ntsc = FrameRate::new(30_000, 1_001);
    assert_eq!(read(&serde_json::to_string(&ntsc).unwrap()), Ok(ntsc));
}

proptest::proptest! {
    #[test]
    fn a_printed_rate_parses_to_itself(num in 1_000u32..1_000_000, den in 1u32..1_002) {
        let rate = FrameRate::new(num, den);
        let is_possible = (1.0..=1000.0).contains(&rate.per_sec());
        proptest::prop_assert_eq!(rate.to_string().parse().ok(), is_possible.then_some(rate));
    }

    #[test]
    fn a_decimal_is_approximated(thousandths in 1_000u32..1_000_000) {
        let rate: FrameRate = format!("{}", f64::from(thousandths) / 1000.0).parse().unwrap();
        proptest::prop_assert!((rate.per_sec() * 1000.0 / f64::from(thousandths) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn no_text_panics(text in "[0-9./ fpse+-]{0,12}|.{0,12}") {
        let _ = text.parse::<FrameRate>();
    }
}
