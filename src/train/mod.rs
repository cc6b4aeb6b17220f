//! Losses, optimiser, checkpoints, logs, and the training loops.
