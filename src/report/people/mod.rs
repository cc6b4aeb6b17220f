//! Page of the errors on rendered people.

pub mod page;
