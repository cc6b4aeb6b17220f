//! What the result of a conversion looks like from outside.

use crate::port::Port;
use anyhow::{Context, Result, bail};

/// What the result looks like from outside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConversionOptions {
    /// Name and shape of the input; the shape is that of the source, where the source says it.
    pub input: Port,
    /// Names of the outputs in the order of the source; one with an empty name is left out.
    pub outputs: Vec<String>,
}

impl ConversionOptions {
    /// The sizes of the input. Errors: a size below 1 or above any picture's.
    pub fn shape(&self) -> Result<Vec<usize>> {
        let size = |size: &i64| usize::try_from(*size).ok().filter(|size| (1..=1 << 14).contains(size));
        let sizes: Option<Vec<usize>> = self.input.shape.iter().map(size).collect();
        sizes.with_context(|| {
            format!("the input {:?} needs sizes of 1 to 16384, not {:?}", self.input.name, self.input.shape)
        })
    }

    /// The name of the only output.
    pub fn only_output(&self) -> Result<&str> {
        match self.outputs.as_slice() {
            [name] if !name.is_empty() => Ok(name),
            names => bail!("the model has one output, which needs one name, not {names:?}"),
        }
    }
}
