//! Speech activity and recognition of speech.

mod unit;
