//! Videos of one speaker to a 3D speech-gesture dataset, and to a model that gestures like that speaker
//! (Rebol, Guetl, Pietroszek 2021; FineMotion's entry to GENEA 2020). This file is the map.
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
//! | 2 | `external` | one door each for the foreign libraries: ffmpeg, OpenCV, ONNX Runtime | `types stage` |
//! | 2 | `audio` | sound to features | `types` |
//! | 2 | `motion` | the body as numbers: bones, forward kinematics, resampling, what the lifters look at | `types math` |
//! | 3 | `formats` | every file format, read and written | `types math stage motion` |
//! | 3 | `nn` | operators, their kernels, the networks | `types motion` |
//! | 4 | `mocap` | motion that others captured, read into our skeleton | `types math motion formats` |
//! | 4 | `metrics` | how good predicted motion is, as pure sums | `types math nn` |
//! | 4 | `generate` | what a trained speaker is, and speech to motion with it | `types audio motion formats nn` |
//! | 4 | `animate` | joints to rotations on a rig, avatar, export, drawing | `types math stage motion formats external` |
//! | 5 | `dataset` | the dataset on disk: write, read, verify, import, forget | `types math stage config audio motion formats external mocap` |
//! | 6 | `pipeline` | the five stages, their order, the files in which they meet; batches of speech to motion | `types math stage config external audio motion formats nn generate animate dataset` |
//! | 6 | `train` | optimiser, GAN, lifters, synthetic scenes, spaces of movement | `types math stage config audio motion formats nn mocap dataset metrics generate` |
//! | 6 | `demo` | the synthetic speaker: drawn, with a known rule, and the checks against it | `types math stage audio motion formats external animate dataset metrics generate` |
//! | 7 | `evaluate` | clips, baselines, table, verdict; the lifters' errors | `types math stage config external audio motion formats nn mocap metrics generate animate dataset pipeline train` |
//! | 8 | `report` | pages for people | `types math stage config external audio motion formats nn mocap metrics generate animate dataset pipeline train evaluate` |
//! | - | `guide` | the pages of the guide, in Markdown | nothing |
//!
//! `cli` (in the program only) imports everything and is the one place that prints. `tests/it/house.rs` holds the code to
//! this table.
//!
//! Invariants: the same input, configuration and seed give the same bytes, whatever the number of workers. A write is
//! an attempt, flushed, renamed (`stage::workdir`), and its record comes last. Memory does not grow with the length of
//! a video, except for its keypoints. No user input panics.

pub mod animate;
pub mod audio;
pub mod config;
pub mod dataset;
pub mod demo;
pub mod evaluate;
pub mod external;
pub mod formats;
pub mod generate;
pub mod guide;
pub mod math;
pub mod metrics;
pub mod mocap;
pub mod motion;
pub mod nn;
pub mod pipeline;
pub mod report;
pub mod stage;
pub mod train;
pub mod types;
