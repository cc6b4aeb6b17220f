//! Stage 5: intervals to shards, statistics and index; and reading them back.
