//! Unit tests of `orator_cluster::job`.

use orator_cluster::job::shell;

#[test]
fn words_are_quoted_for_a_shell() {
    let words = ["--set", "gan.steps=5", "my data", "it's", ""].map(str::to_owned);
    assert_eq!(shell(&words), r"--set gan.steps=5 'my data' 'it'\''s' ''");
}
