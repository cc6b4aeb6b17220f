//! Options of `orator animate` for films of bodies.

use orator_avatar::animate::export::film_avatar::FilmCamera;

#[derive(clap::Args)]
pub(super) struct FilmArgs {
    /// Camera of an .mp4 output; `source` uses the camera fitted to the video of --compare and draws the avatar over
    /// its frames.
    #[arg(long, value_enum, default_value = "front")]
    camera: CameraName,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum CameraName {
    Front,
    ThreeQuarter,
    Source,
}

impl FilmArgs {
    pub(super) fn camera(&self) -> FilmCamera {
        match self.camera {
            CameraName::Front | CameraName::Source => FilmCamera::Front,
            CameraName::ThreeQuarter => FilmCamera::ThreeQuarter,
        }
    }

    /// Whether the avatar is drawn over the video.
    pub(super) fn is_over_video(&self) -> bool {
        self.camera == CameraName::Source
    }

    /// Whether a camera other than the default was given.
    pub(super) fn is_given(&self) -> bool {
        self.camera != CameraName::Front
    }
}
