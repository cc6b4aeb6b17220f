//! Tests of single modules.

mod rest;
