//! Tests of single modules of `orator_gesture::metrics`.

mod basis;
mod beat;
mod cca;
mod definition;
mod embedding;
mod moments;
