//! Unit tests of `orator_study::analyse::text`.

use orator_study::analyse::text::{bare_p, count, counted, list, percent, points};

#[test]
fn numbers_are_rounded_and_grouped() {
    assert_eq!([0, 999, 1083, 2_000_000].map(count), ["0", "999", "1,083", "2,000,000"]);
    assert_eq!([1, 2000].map(|n| counted(n, "vote")), ["1 vote", "2,000 votes"]);
    assert_eq!([1.0, 0.0268, 6.51e-12, 0.0].map(bare_p), ["1", "0.027", "6.5e-12", "< 1e-99"]);
    assert_eq!(
        ([0.1, 0.05, 0.025].map(points), percent(0.525)),
        (["10", "5", "2.5"].map(str::to_owned), "52.5 %".to_owned())
    );
    let names = ["a", "b", "c"].map(str::to_owned);
    assert_eq!((list(&names), list(&names[..1])), ("a, b and c".to_owned(), "a".to_owned()));
}
