//! Texts for users.

use orator_base::text::{
    clock, composed, counted, decomposed, duration, first_three, length, number, percent, with_unit,
};

#[test]
fn names_are_listed_and_normalised() {
    let names = ["a", "b", "c", "d", "e"].map(str::to_owned);
    assert_eq!([3, 4, 5].map(|n| first_three(&names[..n])), ["a, b, c", "a, b, c and 1 other", "a, b, c and 2 others"]);
    for (one, other) in [
        ("Vortr\u{e4}ge", "Vortra\u{308}ge"),
        ("\u{d55c}", "\u{1112}\u{1161}\u{11ab}"),
        ("\u{304c}", "\u{304b}\u{3099}"),
    ] {
        assert_eq!((composed(other), decomposed(one)), (one.to_owned(), other.to_owned()));
        assert_eq!((composed(one), decomposed(other)), (one.to_owned(), other.to_owned()));
    }
    assert_eq!(composed("talk 1.mp4"), "talk 1.mp4");
}

#[test]
fn numbers_are_formatted_with_units_and_separators() {
    assert_eq!([0, 1, 2].map(|n| counted(n, "video")), ["0 videos", "1 video", "2 videos"]);
    assert_eq!(["entry", "key", "process"].map(|noun| counted(2, noun)), ["2 entries", "2 keys", "2 processes"]);
    assert_eq!([59.4, 61.0, 3599.4, 7384.0].map(duration), ["59 s", "1 min 01 s", "59 min 59 s", "2 h 03 min"]);
    assert_eq!([41.24, 744.0, 11_772.0, -0.0].map(length), ["41.2 s", "12.4 min", "3.27 h", "0.0 s"]);
    assert_eq!([4.8, 59.96, 3723.0].map(clock), ["0:04.8", "1:00.0", "1:02:03.0"]);
    assert_eq!(
        [0.34, 1.0, 98.712, 4.267, -50.0, 1234.5, -0.0001].map(number),
        ["0.34", "1", "98.7", "4.27", "-50", "1234", "0"]
    );
    assert_eq!((with_unit(0.5, ""), with_unit(3.0, "s")), ("0.5".to_owned(), "3 s".to_owned()));
    assert_eq!((percent(1.0, 8.0), percent(0.0, 0.0)), ("12.5 %".to_owned(), "\u{2013}".to_owned()));
}
