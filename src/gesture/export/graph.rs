//! The builder of ONNX graphs with the tensors of a network, for expressions of nested operators.

use anyhow::{Context, Result};
use candle_core::Tensor;
use orator_base::types::time::FrameRate;
use orator_onnx::convert::{AttributeValue, ElementType, OnnxGraph};
use std::cell::RefCell;
use std::collections::BTreeMap;

/// Graph under construction. Methods return the names of values, and take a reference, so that calls can be nested.
pub(super) struct NetworkGraph {
    graph: RefCell<OnnxGraph>,
    tensors: BTreeMap<String, Tensor>,
}

impl NetworkGraph {
    /// Empty graph for a network with these tensors.
    pub(super) fn new(tensors: BTreeMap<String, Tensor>) -> Self {
        // The network was checked when it was loaded: its size is not limited again.
        Self { graph: RefCell::new(OnnxGraph::new(usize::MAX)), tensors }
    }

    pub(super) fn into_inner(self) -> OnnxGraph {
        self.graph.into_inner()
    }

    /// Adds an operator without attributes.
    pub(super) fn op(&self, kind: &str, inputs: &[&str]) -> String {
        self.with(kind, inputs, &[])
    }

    pub(super) fn with(&self, kind: &str, inputs: &[&str], attributes: &[(&str, AttributeValue)]) -> String {
        self.graph.borrow_mut().op(kind, inputs, attributes)
    }

    /// Adds an operator with the attribute `axis`.
    pub(super) fn along(&self, kind: &str, inputs: &[&str], axis: i64) -> String {
        self.with(kind, inputs, &[("axis", AttributeValue::Int(axis))])
    }

    /// Adds an operator with two outputs.
    pub(super) fn pair(&self, kind: &str, inputs: &[&str], attributes: &[(&str, AttributeValue)]) -> [String; 2] {
        let outputs = self.graph.borrow_mut().ops(2, kind, inputs, attributes);
        std::array::from_fn(|i| outputs[i].clone())
    }

    /// Adds an operator without attributes whose output is that of the graph.
    pub(super) fn output(&self, name: &str, kind: &str, inputs: &[&str]) {
        self.graph.borrow_mut().output(name, kind, inputs, &[]);
    }

    /// Shape and values of a tensor of the network.
    pub(super) fn tensor(&self, name: &str) -> Result<(Vec<usize>, Vec<f32>)> {
        let tensor = self.tensors.get(name).with_context(|| format!("tensor {name} is missing"))?;
        Ok((tensor.dims().to_vec(), tensor.flatten_all()?.to_vec1()?))
    }

    pub(super) fn has_tensor(&self, name: &str) -> bool {
        self.tensors.contains_key(name)
    }

    /// Adds a tensor of the network as a constant.
    pub(super) fn weight(&self, name: &str) -> Result<String> {
        let (dims, values) = self.tensor(name)?;
        self.floats(&dims, &values)
    }

    pub(super) fn floats(&self, dims: &[usize], values: &[f32]) -> Result<String> {
        self.graph.borrow_mut().floats(dims, values)
    }

    pub(super) fn doubles(&self, dims: &[usize], values: impl IntoIterator<Item = f64>) -> Result<String> {
        let raw: Vec<u8> = values.into_iter().flat_map(f64::to_le_bytes).collect();
        self.graph.borrow_mut().constant(ElementType::F64, dims, &raw)
    }

    /// Adds a float64 without axes.
    pub(super) fn double(&self, value: f64) -> Result<String> {
        self.doubles(&[], [value])
    }

    pub(super) fn integers(&self, values: &[i64]) -> Result<String> {
        self.graph.borrow_mut().ints(values)
    }

    /// Adds an integer without axes.
    fn integer(&self, value: i64) -> Result<String> {
        self.graph.borrow_mut().constant(ElementType::I64, &[], &value.to_le_bytes())
    }

    /// Adds operators on a value and integers without axes.
    pub(super) fn chain(&self, value: &str, steps: &[(&str, i64)]) -> Result<String> {
        steps
            .iter()
            .try_fold(value.to_owned(), |value, (kind, integer)| Ok(self.op(kind, &[&value, &self.integer(*integer)?])))
    }

    /// Size of an axis, an integer without axes.
    pub(super) fn size(&self, value: &str, axis: i64) -> Result<String> {
        self.chain(&self.op("Shape", &[value]), &[("Gather", axis)])
    }

    /// The integers from 0 to `end`.
    pub(super) fn range(&self, end: &str) -> Result<String> {
        Ok(self.op("Range", &[&self.integer(0)?, end, &self.integer(1)?]))
    }

    pub(super) fn cast(&self, value: &str, element: ElementType) -> String {
        self.with("Cast", &[value], &[("to", AttributeValue::Int(element as i64))])
    }

    /// Adds `Reshape`, `Squeeze` or `Unsqueeze` with these sizes or axes.
    pub(super) fn reshaped(&self, kind: &str, value: &str, integers: &[i64]) -> Result<String> {
        Ok(self.op(kind, &[value, &self.integers(integers)?]))
    }

    pub(super) fn transposed(&self, value: &str, axes: &[i64]) -> String {
        self.with("Transpose", &[value], &[("perm", AttributeValue::Ints(axes))])
    }

    /// Sums over an axis, which is dropped unless `is_kept`.
    pub(super) fn sum(&self, value: &str, axis: i64, is_kept: bool) -> Result<String> {
        let attributes = [("keepdims", AttributeValue::Int(i64::from(is_kept)))];
        Ok(self.with("ReduceSum", &[value, &self.integers(&[axis])?], &attributes))
    }

    /// The positions `start..end` of an axis; an `end` below 1 counts from the end of the axis.
    pub(super) fn slice(&self, value: &str, axis: i64, [start, end]: [i64; 2]) -> Result<String> {
        let end = if end == 0 { i64::MAX } else { end };
        Ok(self.op("Slice", &[value, &self.integers(&[start])?, &self.integers(&[end])?, &self.integers(&[axis])?]))
    }

    /// Adds the output `frames` [1], the number of complete pose frames in `n` samples, and returns it without axes.
    pub(super) fn pose_frames(&self, n: &str, fps: FrameRate, rate: u32) -> Result<String> {
        let per_frame = i64::from(fps.den) * i64::from(rate);
        // The program adds a millionth of a frame before it rounds down.
        let steps = [("Mul", i64::from(fps.num)), ("Add", per_frame / 1_000_000), ("Div", per_frame)];
        let frames = self.chain(n, &steps)?;
        self.output("frames", "Reshape", &[&frames, &self.integers(&[1])?]);
        Ok(frames)
    }
}
