//! The guide, one page per topic: `orator guide TOPIC` prints a page, and `make docs` writes all pages as HTML.

mod topics;

pub use topics::{TOPICS, Topic};

#[doc = include_str!("tutorial.md")]
pub mod tutorial {}
#[doc = include_str!("questions.md")]
pub mod questions {}
#[doc = include_str!("dataset.md")]
pub mod dataset {}
#[doc = include_str!("lifting.md")]
pub mod lifting {}
#[doc = include_str!("keypoints.md")]
pub mod keypoints {}
#[doc = include_str!("training.md")]
pub mod training {}
#[doc = include_str!("live.md")]
pub mod live {}
#[doc = include_str!("onnx.md")]
pub mod onnx {}
#[doc = include_str!("gpu.md")]
pub mod gpu {}
#[doc = include_str!("animation.md")]
pub mod animation {}
#[doc = include_str!("evaluation.md")]
pub mod evaluation {}
#[doc = include_str!("results.md")]
pub mod results {}
#[doc = include_str!("papers.md")]
pub mod papers {}
#[doc = include_str!("study.md")]
pub mod study {}
#[doc = include_str!("models.md")]
pub mod models {}
#[doc = include_str!("configuration.md")]
pub mod configuration {}
#[doc = include_str!("cluster.md")]
pub mod cluster {}
#[doc = include_str!("security.md")]
pub mod security {}
#[doc = include_str!("architecture.md")]
pub mod architecture {}
#[doc = include_str!("contributing.md")]
pub mod contributing {}
