//! Distribution of delays in constant memory.

/// Width of a bin in milliseconds, and their number.
const BIN_MS: f64 = 0.5;
const N_BINS: usize = 1000;

/// Histogram of delays, up to 0.5 s.
pub struct Delays {
    bins: Vec<u64>,
    n: u64,
    max_ms: f64,
}

impl Delays {
    pub fn new() -> Self {
        Self { bins: vec![0; N_BINS], n: 0, max_ms: 0.0 }
    }

    pub fn add(&mut self, ms: f64) {
        self.bins[((ms.max(0.0) / BIN_MS) as usize).min(N_BINS - 1)] += 1;
        self.n += 1;
        self.max_ms = self.max_ms.max(ms);
    }

    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    pub fn max_ms(&self) -> f64 {
        self.max_ms
    }

    /// Upper end in milliseconds of the bin that contains the given share of all delays; 0 without delays.
    pub fn quantile_ms(&self, share: f64) -> f64 {
        let (wanted, mut n) = ((share * self.n as f64).ceil() as u64, 0);
        let bin = self.bins.iter().position(|in_bin| {
            n += in_bin;
            n >= wanted
        });
        if self.n == 0 { 0.0 } else { (bin.unwrap_or(0) + 1) as f64 * BIN_MS }
    }
}
