//! A model with its input buffer: the crop or letterboxed picture is drawn into a reused canvas, normalised as the
//! manifest specifies and passed to the model.

use anyhow::Result;
use orator_base::types::image::Image;
use orator_media::opencv::tensor::Normaliser;
use orator_media::opencv::warp::{self, SrcFromDst};
use orator_onnx::{Anchor, Channels, Model, ModelEntry, Outputs, PictureFit, Runtime, TensorAxes};
use std::path::Path;

pub struct ModelInput {
    model: Model,
    canvas: Image,
    normaliser: Normaliser,
}

impl ModelInput {
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self> {
        let [height, width] = entry.input_size()?;
        let picture = &entry.picture;
        let (bgr, planar) = (picture.channels == Channels::Bgr, picture.axes == TensorAxes::Nchw);
        Ok(Self {
            model: Model::open(runtime, entry, dir)?,
            canvas: Image::filled(width, height, [0; 3]),
            normaliser: Normaliser::new(bgr, planar, picture.scale, picture.mean, picture.std),
        })
    }

    /// Height and width of the input in px.
    pub fn size(&self) -> [usize; 2] {
        [self.canvas.height, self.canvas.width]
    }

    /// Inference time in ONNX Runtime so far, in seconds.
    pub fn secs_inside(&self) -> f64 {
        self.model.secs_inside()
    }

    /// Number of inferences so far.
    pub fn n_runs(&self) -> u64 {
        self.model.n_runs()
    }

    /// Runs the model on the full picture, letterboxed as the manifest specifies.
    pub fn run_letterboxed(&mut self, image: &Image) -> Result<(SrcFromDst, Outputs<'_>)> {
        let src_from_dst = match self.model.entry().fit {
            PictureFit::Letterbox { anchor: Anchor::Centre, pad } => {
                warp::letterbox_centre(image, &mut self.canvas, pad)?
            }
            PictureFit::Letterbox { pad, .. } => warp::letterbox_top_left(image, &mut self.canvas, pad)?,
            PictureFit::Box { .. } | PictureFit::Region => warp::letterbox_top_left(image, &mut self.canvas, 0)?,
        };
        Ok((src_from_dst, self.run()?))
    }

    /// Runs the model on the crop that the transform defines.
    pub fn run_crop(&mut self, image: &Image, src_from_dst: &SrcFromDst) -> Result<Outputs<'_>> {
        warp::warp(image, src_from_dst, &mut self.canvas)?;
        self.run()
    }

    fn run(&mut self) -> Result<Outputs<'_>> {
        self.normaliser.fill(&self.canvas, self.model.input_mut());
        self.model.run()
    }
}
