//! Tests of single modules of `orator-report`.

mod histogram;
mod html;
mod live;
mod node;
mod scale;
mod training;
mod videos;
