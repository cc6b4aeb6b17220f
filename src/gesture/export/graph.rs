//! Operators that the graphs of several networks share.

use anyhow::{Context, Result};
use candle_core::{DType, Tensor};
use orator_onnx::convert::{AttributeValue, ElementType, OnnxGraph};
use std::collections::BTreeMap;

/// Graph under construction, with the tensors of its network.
pub struct NetworkGraph {
    pub graph: OnnxGraph,
    tensors: BTreeMap<String, Tensor>,
}

impl NetworkGraph {
    /// Empty graph for a network with these tensors.
    pub fn new(tensors: BTreeMap<String, Tensor>) -> Self {
        // The network has been checked, so its size is not limited again.
        Self { graph: OnnxGraph::new(usize::MAX), tensors }
    }

    /// Adds an operator without attributes.
    pub fn op(&mut self, kind: &str, inputs: &[&str]) -> String {
        self.graph.op(kind, inputs, &[])
    }

    /// Adds an operator over an axis.
    pub fn along(&mut self, kind: &str, inputs: &[&str], axis: i64) -> String {
        self.graph.op(kind, inputs, &[("axis", AttributeValue::Int(axis))])
    }

    /// Shape and values of a tensor of the network.
    pub fn tensor(&self, name: &str) -> Result<(Vec<usize>, Vec<f32>)> {
        let tensor = self.tensors.get(name).with_context(|| format!("tensor {name} is missing"))?;
        Ok((tensor.dims().to_vec(), tensor.flatten_all()?.to_dtype(DType::F32)?.to_vec1()?))
    }

    /// Adds a tensor of the network as a constant.
    pub fn weight(&mut self, name: &str) -> Result<String> {
        let (dims, values) = self.tensor(name)?;
        self.graph.floats(&dims, &values)
    }

    pub fn doubles(&mut self, dims: &[usize], values: &[f64]) -> Result<String> {
        let raw: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.graph.constant(ElementType::F64, dims, &raw)
    }

    /// Adds an integer without axes.
    pub fn integer(&mut self, value: i64) -> Result<String> {
        self.graph.constant(ElementType::I64, &[], &value.to_le_bytes())
    }

    /// Adds an operator on a value and an integer.
    pub fn by(&mut self, kind: &str, value: &str, integer: i64) -> Result<String> {
        let integer = self.integer(integer)?;
        Ok(self.op(kind, &[value, &integer]))
    }

    /// Adds an operator on a value and a number.
    pub fn by_float(&mut self, kind: &str, value: &str, number: f32) -> Result<String> {
        let number = self.graph.floats(&[], &[number])?;
        Ok(self.op(kind, &[value, &number]))
    }

    /// Size of an axis, an integer without axes.
    pub fn size(&mut self, value: &str, axis: i64) -> Result<String> {
        let shape = self.op("Shape", &[value]);
        self.by("Gather", &shape, axis)
    }

    /// The integers from 0 to `end`.
    pub fn range(&mut self, end: &str) -> Result<String> {
        let (first, step) = (self.integer(0)?, self.integer(1)?);
        Ok(self.op("Range", &[&first, end, &step]))
    }

    pub fn cast(&mut self, value: &str, element: ElementType) -> String {
        self.graph.op("Cast", &[value], &[("to", AttributeValue::Int(element as i64))])
    }

    /// Adds an operator with a list of integers as second input: `Reshape`, `Squeeze`, `Unsqueeze`.
    pub fn shaped(&mut self, kind: &str, value: &str, integers: &[i64]) -> Result<String> {
        let integers = self.graph.ints(integers)?;
        Ok(self.op(kind, &[value, &integers]))
    }

    pub fn transposed(&mut self, value: &str, axes: &[i64]) -> String {
        self.graph.op("Transpose", &[value], &[("perm", AttributeValue::Ints(axes))])
    }

    /// The positions `start..end` of an axis; an `end` below 1 counts from the end of the axis.
    pub fn slice(&mut self, value: &str, axis: i64, [start, end]: [i64; 2]) -> Result<String> {
        let end = if end == 0 { i64::MAX } else { end };
        let [start, end, axis] = [start, end, axis].map(|integer| self.graph.ints(&[integer]));
        Ok(self.op("Slice", &[value, &start?, &end?, &axis?]))
    }

    /// Number of complete pose frames in `n` samples, as the program counts them.
    pub fn pose_frames(&mut self, n: &str, fps: orator_base::types::time::FrameRate, rate: u32) -> Result<String> {
        let per_frame = i64::from(fps.den) * i64::from(rate);
        let scaled = self.by("Mul", n, i64::from(fps.num))?;
        // The program adds a millionth of a frame before it rounds down.
        let scaled = self.by("Add", &scaled, per_frame / 1_000_000)?;
        self.by("Div", &scaled, per_frame)
    }
}
