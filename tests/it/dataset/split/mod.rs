//! How videos are divided among the splits.

mod blocks;
