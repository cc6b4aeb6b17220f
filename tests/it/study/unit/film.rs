//! Unit tests of `orator_study::stimuli::film`.

use orator_base::types::time::FrameRate;
use orator_study::file::FilmLayout;
use orator_study::plan::{FilmContent, FilmSound};
use orator_study::stimuli::film::{film_fps, film_name};

#[test]
fn names_depend_on_the_right_avatar_and_otherwise_stay_the_same() {
    let content = |condition: &str| FilmContent {
        clip: "ellen/4".to_owned(),
        speaker: "ellen".to_owned(),
        condition: condition.to_owned(),
        motion_of: "ellen/4".to_owned(),
        number: None,
        sound: FilmSound::Speech,
        right: None,
    };
    let name = |content: &FilmContent| film_name(7, content);
    // The name that versions before side-by-side films gave.
    assert_eq!(name(&content("real")), "6d7eba505208690f");
    let both = content("real").with_right(content("model"));
    let swapped = content("model").with_right(content("real"));
    assert_eq!(both.conditions().collect::<Vec<_>>(), ["real", "model"]);
    let mut names = [name(&content("real")), name(&content("model")), name(&both), name(&swapped)];
    names.sort();
    assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
    let json = serde_json::to_value(content("real")).unwrap();
    assert!(json.get("right").is_none() && serde_json::from_value::<FilmContent>(json).unwrap() == content("real"));
    let numbered = content("real").with_right(FilmContent { number: Some(42), ..content("model") });
    assert_eq!(numbered.number, Some(42));
}

#[test]
fn side_by_side_films_have_thirty_frames_per_second() {
    let [separate, side_by_side] =
        [FilmLayout::Separate, FilmLayout::SideBySide].map(|layout| film_fps(layout, FrameRate::new(25, 1)));
    assert_eq!((separate, side_by_side), (FrameRate::new(50, 1), FrameRate::new(30, 1)));
}
