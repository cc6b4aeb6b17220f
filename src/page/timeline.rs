//! The stretches of a video side by side, each as wide as it lasts: a list, so that it can be read out, walked by keys
//! (`page.js`) and drawn at any width.

use super::html::{Node, node};

/// One stretch.
#[derive(Clone, Debug)]
pub struct Stretch {
    pub start_secs: f64,
    pub end_secs: f64,
    /// What colours it.
    pub class: String,
    /// A word shown where there is room.
    pub word: String,
    /// All there is to say of it.
    pub says: String,
}

/// Stretches narrower than this share of the line are not seen.
const NARROWEST: f64 = 1.0 / 3000.0;
/// With more stretches than this the narrowest are drawn together.
const MOST: usize = 800;

/// The line of a video of `duration_secs`, which `label` names.
pub fn timeline(label: &str, duration_secs: f64, stretches: &[Stretch]) -> Node {
    let whole = duration_secs.max(1e-9);
    let share = |secs: f64| format!("{:.3}%", 100.0 * (secs / whole).clamp(0.0, 1.0));
    let list = node("ol").class("timeline").attr("tabindex", "0").attr("aria-label", label);
    list.children(drawn(stretches, whole).into_iter().map(|stretch| {
        let place =
            format!("left:{};width:{}", share(stretch.start_secs), share(stretch.end_secs - stretch.start_secs));
        let word = node("span").text(&stretch.word);
        node("li").class(&stretch.class).attr("style", place).attr("title", &stretch.says).child(word)
    }))
}

/// The stretches that are drawn: all of them, or, of very many, runs of slivers as one that says how many it is.
fn drawn(stretches: &[Stretch], whole: f64) -> Vec<Stretch> {
    if stretches.len() <= MOST {
        return stretches.to_vec();
    }
    let narrow = |stretch: &Stretch| stretch.end_secs - stretch.start_secs < NARROWEST * whole;
    // Each with the number of slivers in it.
    let mut drawn: Vec<(Stretch, usize)> = Vec::new();
    for stretch in stretches {
        match drawn.last_mut() {
            Some((run, n)) if *n > 0 && narrow(stretch) && narrow(run) => {
                run.end_secs = stretch.end_secs;
                *n += 1;
            }
            _ => drawn.push((stretch.clone(), usize::from(narrow(stretch)))),
        }
    }
    let told = drawn.into_iter().map(|(stretch, n)| match n {
        0 | 1 => stretch,
        n => Stretch { says: format!("{n} short stretches, the first: {}", stretch.says), ..stretch },
    });
    told.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_every_stretch_and_very_many_are_drawn_together() {
        let of = |n: usize| {
            let one = |i: usize| Stretch {
                start_secs: i as f64,
                end_secs: (i + 1) as f64,
                class: format!("c{}", i % 2),
                word: String::new(),
                says: "<one>".to_owned(),
            };
            timeline("a \"b\"", n as f64, &(0..n).map(one).collect::<Vec<_>>()).to_string()
        };
        assert_eq!(of(10).matches("<li").count(), 10);
        assert!(of(10).contains("left:90.000%;width:10.000%") && of(10).contains("title=\"&lt;one&gt;\""));
        assert!(of(100_000).matches("<li").count() <= 3001);
        assert_eq!(timeline("", 0.0, &[]).to_string().matches("<li").count(), 0);
    }
}
