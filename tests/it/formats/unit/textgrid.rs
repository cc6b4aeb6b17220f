//! Unit tests of `orator_formats::transcript::textgrid`.

use orator_formats::transcript::textgrid::read;

const LONG: &str = "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\nxmin = 0\nxmax = 2\ntiers? <exists>\n\
    size = 2\nitem []:\n    item [1]:\n        class = \"IntervalTier\"\n        name = \"phones\"\n        xmin = 0\n\
    xmax = 2\n        intervals: size = 1\n        intervals [1]:\n            xmin = 0\n            xmax = 2\n\
    text = \"s\"\n    item [2]:\n        class = \"IntervalTier\"\n        name = \"words\"\n        xmin = 0\n\
    xmax = 2\n        intervals: size = 2\n        intervals [1]:\n            xmin = 0\n            xmax = 0.5\n\
    text = \"\"\n        intervals [2]:\n            xmin = 0.5\n            xmax = 2\n            text = \"so\"\n";
const SHORT: &str = "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\n0\n2\n<exists>\n1\n\"IntervalTier\"\n\
    \"words\"\n0\n2\n2\n0\n0.5\n\"\"\n0.5\n2\n\"so\"\n";

#[test]
fn labels_may_contain_line_breaks_and_quotes() {
    let found = |text: &str| {
        let words = read(text, "").map_err(|error| error.to_string())?;
        Ok::<_, String>(words.into_iter().map(|word| word.word).collect::<Vec<_>>().join(" "))
    };
    for text in [LONG, SHORT] {
        let labelled = |label: &str| found(&text.replace("\"so\"", label));
        assert_eq!(labelled("\"so\n\"").unwrap(), "so");
        assert_eq!(labelled("\"so\nwell\"").unwrap(), "so well");
        assert_eq!(labelled("\"\"\"so\"\"\n\nthey \"\"said\"\"\"").unwrap(), "\"so\" they \"said\"");
        assert_eq!(labelled("\"{LG}\n\"").unwrap(), "");
        assert!(labelled("\"so").unwrap_err().contains("closing quote"));
    }
    // Undoubled quotes, as some programs write them.
    assert_eq!(found(&LONG.replace("text = \"s\"", "text = \"5\" s\"")).unwrap(), "so");
    assert_eq!(found(&SHORT.replace("0.5\n2\n\"so\"", "0.5 2 \"so\"")).unwrap(), "so");
}
