//! Tests of single modules of `orator_formats::word_vectors`.

mod table;
