//! Web pages of a study for participants and the operator, and their texts in several languages. Plain ES modules
//! without libraries; nothing is loaded from other hosts, and there are no inline scripts or styles.

pub mod assets;
