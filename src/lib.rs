//! Videos of one speaker to a 3D speech-gesture dataset, and to a model that gestures like that speaker
//! (Rebol, Guetl, Pietroszek 2021; FineMotion's entry to GENEA 2020).
//!
//! The items below are the public interface. A [`Pipeline`] is opened with a [`Config`] and does all that `orator run`
//! does; [`Lifter`], [`GestureGenerator`], [`perform`], [`Dataset`] and [`Evaluation`] do one thing each. Errors are
//! [`anyhow::Error`]s that name file, position and remedy; those that a program handles separately are found by
//! `downcast_ref`: [`ConfigError`], [`ModelError`], [`UnreadableMedia`], [`NothingAccepted`], [`BusyFolder`],
//! [`NoSpace`], [`StoppedTraining`].
//!
//! The workspace, from the lowest layer up; Cargo enforces that a crate depends only on those its manifest names:
//!
//! | crate | contents |
//! |---|---|
//! | `orator-base` | plain values, mathematics, body model, audio features, stage records; no foreign library |
//! | `orator-formats` | every file format; motion capture converted to the skeleton of the program |
//! | `orator-media` | FFmpeg, OpenCV, the word aligner, the sandbox |
//! | `orator-onnx` | ONNX Runtime, the model store, model conversion |
//! | `orator-nn` | operators with their kernels, and the networks (candle) |
//! | `orator-speech` | speech recognition and word times (Whisper) |
//! | `orator-avatar` | rigs, retargeting, export, the software renderer |
//! | `orator-dataset` | `pipeline.toml`, and the dataset on disk: write, read, verify, import, forget |
//! | `orator-pipeline` | the six stages, their order, and their processes |
//! | `orator-gesture` | training, generation, metrics, evaluation |
//! | `orator-report` | HTML pages |
//! | `orator-web` | HTTP servers: connections, limits, security headers |
//! | `orator-study` | user studies: films, server, statistics |
//! | `orator-live` | gestures to speech in real time: clock, VMC, JSON lines |
//! | `orator-view` | the local page of `orator view` and `orator live` |
//! | `orator-cluster` | several machines that share one work folder |
//! | `orator` | this library and the program |
//! | `orator-test-support` | inputs with known truth for tests |
//! | `orator-lab` | synthetic speakers, training and evaluation of the shipped lifters; its own program |
//!
//! Data flow. A frame: `media::ffmpeg` -> `media::opencv` (crop, warp) -> `onnx` -> `pipeline::pose2d` (decode, track) ->
//! *keypoints* -> `pipeline::segment` -> `pipeline::lift` -> *joints* -> `dataset::write` -> *shard* -> `dataset::read` ->
//! `gesture::train`. An audio sample: `media::ffmpeg` -> *audio file* -> `dataset::write` -> *shard* -> `dataset::read`
//! -> `base::audio::mel` -> `nn::gan`. Audio and frames are aligned by time in seconds (`base::types::sound`).
//!
//! Invariants: the same input, configuration and seed give the same bytes, whatever the number of workers. Writes are
//! atomic: attempt file, fsync, rename (`base::stage::workdir`), record last. Readers of a dataset or a model hold its
//! shared lock, writers the exclusive one; locks are taken in the order work folder, dataset, model, and a lock that is
//! held is an immediate error, not a wait. Memory does not grow with the length of a video, except for its keypoints.
//! No user input panics.

#![warn(missing_docs)]

#[doc(hidden)]
pub mod cli;
pub mod guide;
#[doc(hidden)]
pub mod process;

// Videos to datasets.
pub use orator_base::stage::artifacts::StageName;
pub use orator_base::stage::progress::{Event, Progress, Silent, Task};
pub use orator_dataset::config::{Config, load as load_config};
pub use orator_pipeline::{Pipeline, RunReport, Selection, StatusReport, TimeBudget};

// Values.
pub use orator_base::types::pose2d::Keypoints;
pub use orator_base::types::pose3d::Motion;
pub use orator_base::types::sound::Sound;
pub use orator_base::types::time::FrameRate;

// Keypoints to motion.
pub use orator_dataset::config::LiftConfig;
pub use orator_formats::keypoints_npz::read as read_keypoints;
pub use orator_pipeline::lift::{Lifted, Lifter};

// Datasets.
pub use orator_dataset::index::SampleRef;
pub use orator_dataset::{Dataset, Sample, Split};

// Speech to motion.
pub use orator_formats::word_vectors::WordVectors;
pub use orator_gesture::batch::{BatchReport, SpeechBatch};
pub use orator_gesture::generate::GestureGenerator;
pub use orator_gesture::generate::seq2seq::SequenceGenerator;
pub use orator_media::ffmpeg::audio::read_sound;
pub use orator_nn::device::Device;
pub use orator_nn::seq2seq::predict::StateAtSeams;

// Motion to files for animation programs.
pub use orator_avatar::animate::export::file::{ExportContent, ExportFormat, FigureOptions};
pub use orator_avatar::animate::{AnimationOptions, Performance, perform};

// Predicted motion against ground truth.
pub use orator_gesture::evaluate::Evaluation;
pub use orator_gesture::evaluate::clips::checkpoint::EvaluatedCheckpoint;
pub use orator_gesture::generate::trained::TrainedSpeaker;
pub use orator_gesture::metrics::settings::MetricSettings;

// Image models.
pub use orator_onnx::{ModelState, ModelStore};

// Errors for `downcast_ref`.
pub use orator_base::stage::workdir::{BusyFolder, NoSpace};
pub use orator_dataset::config::ConfigError;
pub use orator_gesture::train::epochs::StoppedTraining;
pub use orator_media::ffmpeg::UnreadableMedia;
pub use orator_onnx::ModelError;
pub use orator_pipeline::dataset::NothingAccepted;
