//! Command lines for a POSIX shell.

/// The words as a shell reads them, quoted where they must be.
pub fn shell(words: &[String]) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=:,+@%".contains(c);
    let quoted = |word: &String| match !word.is_empty() && word.chars().all(is_plain) {
        true => word.clone(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    };
    words.iter().map(quoted).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::shell;

    #[test]
    fn words_are_quoted_for_a_shell() {
        let words = ["--set", "gan.steps=5", "my data", "it's", ""].map(str::to_owned);
        assert_eq!(shell(&words), r"--set gan.steps=5 'my data' 'it'\''s' ''");
    }
}
