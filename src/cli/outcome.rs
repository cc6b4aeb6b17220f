//! How a verb ended, which becomes the exit code.

/// How a verb ended, when it ended well enough to say so itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Everything asked for is done.
    Done,
    /// Some units failed (each was reported); the others are done.
    SomeFailed,
    /// Ended early by request (Ctrl-C, SIGTERM), at a place from which the same command goes on.
    Stopped,
    /// What was looked at (the set-up, a dataset) is not as it must be; what is wrong was printed.
    Wrong,
}
