//! Videos of one speaker to a 3D speech-gesture dataset, and to a model that gestures like that speaker
//! (Rebol, Guetl, Pietroszek 2021; FineMotion's entry to GENEA 2020). This file is the map.
//!
//! The way of a frame, never turning back:
//! `media::frames` -> `vision` (crop, warp) -> `onnx` -> `pose2d` (decode, track) -> *keypoints file* -> `segment` ->
//! `lift` -> *joints file* -> `dataset` -> *shard* -> `dataset::read` -> `train::examples` (windows) -> `train::gan`.
//!
//! The way of a sample of sound: `media::audio` -> *audio file* -> `dataset` -> *shard* -> `dataset::read` -> `train::examples` ->
//! `audio::mel` -> `nn` generator. The two meet by time in seconds, in one place: where a shard is written.
//!
//! | room | what lives there | imports |
//! |---|---|---|
//! | `types` | plain values: time, picture, keypoints, joints, sound, interval | nothing |
//! | `stage` | how any step runs, is recorded and resumes; knows no step | `types` |
//! | `config` | `pipeline.toml`, as written and resolved | `types stage` |
//! | `media` | the only room that knows ffmpeg | `types stage` |
//! | `vision` | the only room that knows OpenCV | `types stage` |
//! | `onnx` | the only room that knows ONNX Runtime; the model manifest | `types stage config` |
//! | `audio` | sound to features | `types` |
//! | `motion` | motion as numbers: bones, rotations, smoothing; motion files | `types` |
//! | `metrics` | how good made motion is beside the real one, as pure sums | `types motion nn` |
//! | `nn` | network architectures | `types motion` |
//! | `extract` | stage 1: sound, timeline, shots | `media vision` |
//! | `pose2d` | stage 2: 2D keypoints of the one speaker | `media vision onnx motion` |
//! | `segment` | stage 3: intervals worth keeping, refusals with reasons | `motion media` |
//! | `lift` | stage 4: 2D to 3D | `motion nn` |
//! | `dataset` | stage 5: shards; and reading them back | `motion media audio` |
//! | `train` | losses, optimiser, checkpoints, the two training loops | `motion nn audio dataset metrics` |
//! | `evaluate` | errors of the lifters on captured motion; made motion beside the real one, with what defends each figure | `motion media nn train lift metrics audio dataset generate import` |
//! | `generate` | speech to motion with a trained speaker | `motion nn audio train metrics` |
//! | `animate` | joints to rotations; BVH, GLB with an avatar of our own, and drawn video | `motion media vision` |
//! | `page` | HTML pages for people: elements, plots, one file | nothing |
//! | `report` | what became of every second, how a training went, and how good made motion is, each on one page; no stage, so it may know `segment` | `motion media vision segment animate page train metrics evaluate` |
//! | `import` | motion that others captured, with its sound, becomes a dataset | `motion media audio dataset` |
//! | `forget` | a video and all that was derived from it goes, and a search proves it | `dataset` |
//! | `demo` | the synthetic speaker: videos with known truth, hours by a known rule, and the comparison with both | `motion media vision audio dataset animate train generate metrics` |
//!
//! Stages meet in files, never in code; all of them may use `types`, `stage` and `config`. `cli` (in the program
//! only) imports everything and is the one place that prints. `tests/it/house.rs` holds the code to this table.
//! `generate` may import `train`, since `train::speaker` alone says what a checkpoint means.
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
