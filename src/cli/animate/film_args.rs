//! Options of `orator animate` that say how a film shows bodies.

use anyhow::{Result, ensure};
use orator_avatar::animate::export::film_avatar::FilmCamera;
use orator_avatar::animate::export::film_panel::FilmStyle;

#[derive(clap::Args)]
pub struct FilmArgs {
    /// Body of a film: a clothed avatar, or the bones as a drawn figure with its sides in two colours.
    #[arg(long, value_enum, default_value = "avatar")]
    style: StyleName,
    /// Where a film sees the avatar from; `source`: from the camera of the video --beside that the motion was lifted
    /// from, before its picture.
    #[arg(long, value_enum, default_value = "front")]
    camera: CameraName,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum StyleName {
    Avatar,
    Figure,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum CameraName {
    Front,
    ThreeQuarter,
    Source,
}

impl FilmArgs {
    pub fn style(&self) -> FilmStyle {
        match (self.style, self.camera) {
            (StyleName::Figure, _) => FilmStyle::Figure,
            (StyleName::Avatar, CameraName::Front | CameraName::Source) => FilmStyle::Avatar(FilmCamera::Front),
            (StyleName::Avatar, CameraName::ThreeQuarter) => FilmStyle::Avatar(FilmCamera::ThreeQuarter),
        }
    }

    /// Whether the avatar stands before the video.
    pub fn is_over_video(&self) -> bool {
        self.camera == CameraName::Source
    }

    /// Options and whether they were given another value than the plain one.
    pub fn given(&self) -> [(&'static str, bool); 2] {
        [("--style", self.style != StyleName::Avatar), ("--camera", self.camera != CameraName::Front)]
    }

    /// Errors on a camera without the avatar.
    pub fn check(&self) -> Result<()> {
        let both = self.given().iter().all(|(_, is_given)| *is_given);
        ensure!(!both, "--camera is for the avatar: leave --style figure or --camera away");
        Ok(())
    }
}
