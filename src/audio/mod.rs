//! Waveforms to features (log-mel). Pure.
