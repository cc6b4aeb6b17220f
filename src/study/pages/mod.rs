//! The pages of a study: what participants and the operator see, and its texts in several languages. Plain ES modules
//! without any library; nothing is loaded from elsewhere, nothing stands inline.

pub mod assets;
pub mod page_texts;
