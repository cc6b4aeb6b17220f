//! Videos of one speaker to a 3D speech-gesture dataset, and to a model that gestures like that speaker
//! (Rebol, Guetl, Pietroszek 2021; FineMotion's entry to GENEA 2020). This file is the map.
//!
//! The items below are the public interface. A [`Pipeline`] is opened with a [`Config`] and does all that `orator run`
//! does; [`Lifter`], [`GestureGenerator`], [`perform`], [`Dataset`] and [`Evaluation`] do one thing each. Errors are
//! [`anyhow::Error`]s that name file, place and remedy; those a program handles apart are found by `downcast_ref`:
//! [`ConfigError`], [`ModelError`], [`UnreadableMedia`], [`NothingKept`], [`BusyFolder`], [`NoSpace`],
//! [`StoppedTraining`]. The rooms themselves are public for the program, tests and benchmarks, and may change.
//!
//! A frame: `external::ffmpeg` -> `external::opencv` (crop, warp) -> `external::onnx` -> `pipeline::pose2d` (decode,
//! track) -> *keypoints* -> `pipeline::segment` -> `pipeline::lift` -> *joints* -> `dataset::write` -> *shard* ->
//! `dataset::read` -> `train::gan`.
//!
//! A sample of sound: `external::ffmpeg` -> *audio file* -> `dataset::write` -> *shard* -> `dataset::read` ->
//! `audio::mel` -> `nn::gan`. Sound and frames meet by time in seconds (`types::sync`).
//!
//! A room imports only from the rooms that its row names, all of them on lower floors:
//!
//! | floor | room | what lives there | may import |
//! |---|---|---|---|
//! | 1 | `types` | plain values: time, sync of sound and frames, picture, keypoints, joints, sound, interval, split | nothing |
//! | 1 | `math` | vectors, rotations, Procrustes, eigenvalues, filters, median and quantiles | nothing |
//! | 1 | `stage` | how any step runs, is recorded and resumes; the ledger | nothing |
//! | 2 | `config` | `pipeline.toml`, as written and resolved | `types stage` |
//! | 2 | `external` | one door each for the foreign libraries: ffmpeg, OpenCV, ONNX Runtime; the aligner of words; the sandbox of processes | `types stage` |
//! | 2 | `audio` | sound to features | `types` |
//! | 2 | `motion` | the body as numbers: bones, forward kinematics, resampling, what the lifters look at | `types math` |
//! | 3 | `formats` | every file format, read and written | `types math stage motion` |
//! | 3 | `nn` | operators, their kernels, the networks | `types motion` |
//! | 3 | `render` | software renderer: posed meshes seen by a camera | `types math` |
//! | 4 | `mocap` | motion that others captured, read into our skeleton | `types math motion formats` |
//! | 4 | `metrics` | how good predicted motion is, as pure sums | `types math nn` |
//! | 4 | `generate` | what a trained speaker is, and speech to motion with it | `types audio motion formats nn` |
//! | 4 | `animate` | joints to rotations on a rig, avatar, export, drawing | `types math stage motion formats external render` |
//! | 5 | `dataset` | the dataset on disk: write, read, verify, import, forget | `types math stage config audio motion formats external mocap` |
//! | 6 | `pipeline` | the five stages, their order, the files in which they meet, their processes; batches of speech to motion | `types math stage config external audio motion formats nn generate animate dataset` |
//! | 6 | `train` | optimiser, GAN, lifters, body network, synthetic scenes, spaces of movement | `types math stage config external audio motion formats nn mocap dataset metrics generate` |
//! | 6 | `demo` | synthetic speakers: drawn, rendered, with a known rule, and the checks against them | `types math stage audio motion formats external mocap render animate dataset metrics generate` |
//! | 7 | `cluster` | many machines on one work folder: sealed plan, times of the stages, claims, workers, the scripts that start them | `types stage config external formats pipeline` |
//! | 7 | `evaluate` | clips, baselines, table, verdict; the lifters' errors | `types math stage config external audio motion formats nn mocap metrics generate animate dataset pipeline train` |
//! | 8 | `report` | pages for people | `types stage config external formats metrics animate dataset pipeline train evaluate` |
//! | 9 | `study` | user studies: films built and sealed, served, responses analysed | `types math stage config external audio motion formats mocap metrics generate animate dataset evaluate report` |
//! | - | `guide` | the pages of the guide, in Markdown | nothing |
//!
//! `cli` (in the program only) imports everything and is the one place that prints. `tests/it/house.rs` holds the code to
//! this table.
//!
//! Invariants: the same input, configuration and seed give the same bytes, whatever the number of workers. A write is
//! an attempt, flushed, renamed (`stage::workdir`), and its record comes last. What reads a dataset or a model shares its
//! lock, what replaces or forgets one has it alone; locks are taken in the order work folder, dataset, model, and none is
//! waited for: who comes second is told who is at work. Memory does not grow with the length of
//! a video, except for its keypoints. No user input panics.

#![warn(missing_docs)]
#![cfg_attr(not(test), deny(clippy::print_stderr))]
// `[T, 49, 3]` in a comment is a shape, no link.
#![allow(rustdoc::broken_intra_doc_links)]

#[doc(hidden)]
pub mod animate;
#[doc(hidden)]
pub mod audio;
#[doc(hidden)]
pub mod cluster;
#[doc(hidden)]
pub mod config;
#[doc(hidden)]
pub mod dataset;
#[doc(hidden)]
pub mod demo;
#[doc(hidden)]
pub mod evaluate;
#[doc(hidden)]
pub mod external;
#[doc(hidden)]
pub mod formats;
#[doc(hidden)]
pub mod generate;
pub mod guide;
#[doc(hidden)]
pub mod math;
#[doc(hidden)]
pub mod metrics;
#[doc(hidden)]
pub mod mocap;
#[doc(hidden)]
pub mod motion;
#[doc(hidden)]
pub mod nn;
#[doc(hidden)]
pub mod pipeline;
#[doc(hidden)]
pub mod render;
#[doc(hidden)]
pub mod report;
#[doc(hidden)]
pub mod stage;
#[doc(hidden)]
pub mod study;
#[doc(hidden)]
pub mod train;
#[doc(hidden)]
pub mod types;

// Videos to datasets.
pub use config::{Config, load as load_config};
pub use pipeline::{Pipeline, RunReport, Selection, StatusReport, TimeAccount};
pub use stage::artifacts::StageName;
pub use stage::progress::{Event, Progress, Silent, Task};

// Values.
pub use types::pose2d::Keypoints;
pub use types::pose3d::Motion;
pub use types::sound::Sound;
pub use types::time::FrameRate;

// Keypoints to motion.
pub use config::LiftConfig;
pub use formats::keypoints_npz::read as read_keypoints;
pub use pipeline::lift::{Lifted, Lifter};

// Datasets.
pub use dataset::index::SampleRef;
pub use dataset::{Dataset, Sample, Split};

// Speech to motion.
pub use external::ffmpeg::audio::read_sound;
pub use generate::GestureGenerator;
pub use generate::seq2seq::SequenceGenerator;
pub use nn::seq2seq::predict::StateAtSeams;
pub use pipeline::batch::{BatchReport, SpeechBatch};

// Motion to files for animation programs.
pub use animate::export::file::{ExportContent, ExportFormat, FigureOptions};
pub use animate::{AnimationOptions, Performance, perform};

// Predicted motion against ground truth.
pub use evaluate::Evaluation;
pub use evaluate::clips::checkpoint::EvaluatedCheckpoint;
pub use generate::trained::TrainedSpeaker;
pub use metrics::settings::MetricSettings;

// Models that look at pictures.
pub use external::onnx::{ModelState, ModelStore};

// Errors to be matched.
pub use config::ConfigError;
pub use external::ffmpeg::UnreadableMedia;
pub use external::onnx::ModelError;
pub use pipeline::dataset::NothingKept;
pub use stage::workdir::{BusyFolder, NoSpace};
pub use train::stopped::StoppedTraining;
