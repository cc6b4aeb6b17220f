//! An ONNX graph under construction: operators in execution order, and weights, where equal ones are stored once.

use super::layout::{SlidingWindow, four, transposed};
use super::protobuf::{bytes, float, number};
use anyhow::{Result, ensure};
use std::collections::BTreeMap;

/// Element type of a tensor, with its number in ONNX.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ElementType {
    F32 = 1,
    I32 = 6,
    I64 = 7,
    F16 = 10,
    F64 = 11,
}

impl ElementType {
    pub(crate) const fn n_bytes(self) -> usize {
        match self {
            Self::F16 => 2,
            Self::F32 | Self::I32 => 4,
            Self::I64 | Self::F64 => 8,
        }
    }
}

#[derive(Clone, Copy)]
pub enum AttributeValue<'a> {
    Int(i64),
    Float(f32),
    Text(&'a str),
    Ints(&'a [i64]),
}

/// Name, element type and axes of an input or output; an axis is a size or, for any size, a name: `1,64,frames`.
pub type GraphPort<'a> = (&'a str, ElementType, &'a str);

/// First size of an input or output that has one entry per image of a batch of any size.
pub(crate) const ANY_BATCH: usize = 0;
/// Name of that size in the file.
pub(crate) const BATCH: &str = "batch";

/// Builder with the operators and weights added so far.
pub struct OnnxGraph {
    nodes: Vec<u8>,
    n_ops: usize,
    weights: Vec<u8>,
    constants: BTreeMap<(ElementType, Vec<usize>, Vec<u8>), String>,
    n_weight_bytes_left: usize,
}

impl OnnxGraph {
    /// Empty graph for a source of `n_bytes`, which limits the weights: no conversion more than doubles their size.
    pub fn new(n_bytes: usize) -> Self {
        let n_weight_bytes_left = n_bytes.saturating_mul(2).saturating_add(1 << 20);
        Self { nodes: Vec::new(), n_ops: 0, weights: Vec::new(), constants: BTreeMap::new(), n_weight_bytes_left }
    }

    /// Adds an operator with one output and returns the name of the output.
    pub fn op(&mut self, kind: &str, inputs: &[&str], attributes: &[(&str, AttributeValue)]) -> String {
        let output = format!("t{}", self.n_ops + 1);
        self.add(kind, inputs, std::slice::from_ref(&output), attributes);
        output
    }

    /// Adds an operator whose output is the graph output `name`.
    pub fn output(&mut self, name: &str, kind: &str, inputs: &[&str], attributes: &[(&str, AttributeValue)]) {
        self.add(kind, inputs, &[name.to_owned()], attributes);
    }

    /// Adds an operator with `n` outputs and returns their names.
    pub fn ops(&mut self, n: usize, kind: &str, inputs: &[&str], attributes: &[(&str, AttributeValue)]) -> Vec<String> {
        let outputs: Vec<String> = (0..n).map(|k| format!("t{}_{k}", self.n_ops + 1)).collect();
        self.add(kind, inputs, &outputs, attributes);
        outputs
    }

    fn add(&mut self, kind: &str, inputs: &[&str], outputs: &[String], attributes: &[(&str, AttributeValue)]) {
        self.n_ops += 1;
        let mut node = Vec::new();
        inputs.iter().for_each(|input| bytes(&mut node, 1, input.as_bytes()));
        outputs.iter().for_each(|output| bytes(&mut node, 2, output.as_bytes()));
        bytes(&mut node, 3, format!("n{}", self.n_ops).as_bytes());
        bytes(&mut node, 4, kind.as_bytes());
        let mut sorted = attributes.to_vec();
        sorted.sort_by_key(|(name, _)| *name);
        sorted.iter().for_each(|(name, value)| bytes(&mut node, 5, &attribute(name, *value)));
        bytes(&mut self.nodes, 1, &node);
    }

    /// Adds a constant, or reuses an equal one, and returns its name; float16 is cast to float32.
    ///
    /// # Errors
    ///
    /// `raw` (little-endian) does not match `dims`, or the weights exceed the limit for the source.
    pub fn constant(&mut self, element: ElementType, dims: &[usize], raw: &[u8]) -> Result<String> {
        let size = element.n_bytes();
        let n_bytes = dims.iter().try_fold(size, |product: usize, dim| product.checked_mul(*dim));
        ensure!(
            n_bytes == Some(raw.len()),
            "a weight of shape {dims:?} with {size} bytes per value cannot have {} bytes",
            raw.len()
        );
        let key = (element, dims.to_vec(), raw.to_vec());
        if let Some(name) = self.constants.get(&key) {
            return Ok(name.clone());
        }
        ensure!(raw.len() <= self.n_weight_bytes_left, "the converted weights exceed twice the size of the source");
        self.n_weight_bytes_left -= raw.len();
        let mut name = format!("w{}", self.constants.len());
        let mut tensor = Vec::with_capacity(raw.len() + 64);
        dims.iter().for_each(|dim| number(&mut tensor, 1, *dim as i64));
        number(&mut tensor, 2, element as i64);
        bytes(&mut tensor, 8, name.as_bytes());
        bytes(&mut tensor, 9, raw);
        bytes(&mut self.weights, 5, &tensor);
        if element == ElementType::F16 {
            name = self.op("Cast", &[&name], &[("to", AttributeValue::Int(ElementType::F32 as i64))]);
        }
        self.constants.insert(key, name.clone());
        Ok(name)
    }

    /// Adds a weight of shape `shape`, with its axes reordered by `order` or reshaped to `dims`.
    pub fn weight(
        &mut self,
        (element, shape, raw): (ElementType, &[usize], &[u8]),
        order: Option<[usize; 4]>,
        dims: Option<&[usize]>,
    ) -> Result<String> {
        let Some(order) = order else { return self.constant(element, dims.unwrap_or(shape), raw) };
        let shape = four("the weight", shape)?;
        let raw = transposed(raw, element.n_bytes(), shape, order)?;
        self.constant(element, &order.map(|axis| shape[axis]), &raw)
    }

    pub fn floats(&mut self, dims: &[usize], values: &[f32]) -> Result<String> {
        self.constant(ElementType::F32, dims, &values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>())
    }

    /// Adds a 1-D constant of sizes.
    pub fn sizes(&mut self, sizes: &[usize]) -> Result<String> {
        self.ints(&sizes.iter().map(|size| *size as i64).collect::<Vec<_>>())
    }

    pub fn concat(&mut self, values: &[String], axis: i64) -> String {
        self.op("Concat", &as_strs(values), &[("axis", AttributeValue::Int(axis))])
    }

    /// Reshapes each entry of a batch; a size of -1 is the rest.
    pub(crate) fn reshaped(&mut self, value: &str, entry: &[i64]) -> Result<String> {
        // A size of 0 is that of the input.
        let sizes = self.ints(&[&[0], entry].concat())?;
        Ok(self.op("Reshape", &[value, &sizes], &[]))
    }

    /// Resizes height and width by integer factors.
    pub(crate) fn scaled(&mut self, value: &str, by: [usize; 2], mode: &[(&str, AttributeValue)]) -> Result<String> {
        let scales = self.floats(&[4], &[1.0, 1.0, by[0] as f32, by[1] as f32])?;
        Ok(self.op("Resize", &[value, "", &scales], mode))
    }

    /// Clips values to 0..6.
    pub fn relu6(&mut self, value: &str) -> Result<String> {
        let (low, high) = (self.floats(&[], &[0.0])?, self.floats(&[], &[6.0])?);
        Ok(self.op("Clip", &[value, &low, &high], &[]))
    }

    /// Convolution (`inputs`: image, weight and optionally bias; `group`) or, without `group`, max pooling, over
    /// height and width. `pads`: zeros at the top, left, bottom and right.
    pub(crate) fn windowed(
        &mut self,
        inputs: &[String],
        windows: [SlidingWindow; 2],
        pads: [i64; 4],
        group: Option<usize>,
        has_dilations: bool,
    ) -> String {
        let per_axis = |of: fn(SlidingWindow) -> usize| windows.map(|window| of(window) as i64);
        let [kernel, strides] = [per_axis(|window| window.kernel), per_axis(|window| window.stride)];
        let dilations = per_axis(|window| window.dilation);
        let mut attributes = vec![
            ("kernel_shape", AttributeValue::Ints(&kernel)),
            ("strides", AttributeValue::Ints(&strides)),
            ("pads", AttributeValue::Ints(&pads)),
        ];
        attributes.extend(group.map(|group| ("group", AttributeValue::Int(group as i64))));
        attributes.extend(has_dilations.then_some(("dilations", AttributeValue::Ints(&dilations))));
        self.op(if group.is_some() { "Conv" } else { "MaxPool" }, &as_strs(inputs), &attributes)
    }

    /// Adds a 1-D integer constant.
    pub fn ints(&mut self, values: &[i64]) -> Result<String> {
        let raw: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.constant(ElementType::I64, &[values.len()], &raw)
    }

    /// Contents of the model file with these float32 inputs and outputs (name and shape).
    pub fn model(self, inputs: &[(&str, &[usize])], outputs: &[(&str, &[usize])]) -> Vec<u8> {
        let axis = |dim: &usize| if *dim == ANY_BATCH { BATCH.to_owned() } else { dim.to_string() };
        let axes = |ports: &[(&str, &[usize])]| -> Vec<String> {
            ports.iter().map(|(_, dims)| dims.iter().map(axis).collect::<Vec<_>>().join(",")).collect()
        };
        let (of_inputs, of_outputs) = (axes(inputs), axes(outputs));
        let inputs: Vec<GraphPort> =
            inputs.iter().zip(&of_inputs).map(|((name, _), axes)| (*name, ElementType::F32, &**axes)).collect();
        let outputs: Vec<GraphPort> =
            outputs.iter().zip(&of_outputs).map(|((name, _), axes)| (*name, ElementType::F32, &**axes)).collect();
        self.file("pose", &inputs, &outputs, &[])
    }

    /// Contents of the model file with the name `title`, these inputs and outputs, and metadata (key and value).
    pub fn file(
        self,
        title: &str,
        inputs: &[GraphPort],
        outputs: &[GraphPort],
        metadata: &[(&str, String)],
    ) -> Vec<u8> {
        let mut graph = self.nodes;
        bytes(&mut graph, 2, title.as_bytes());
        graph.extend_from_slice(&self.weights);
        inputs.iter().for_each(|input| bytes(&mut graph, 11, &port(*input)));
        outputs.iter().for_each(|output| bytes(&mut graph, 12, &port(*output)));
        let (mut opset, mut model) = (Vec::new(), Vec::with_capacity(graph.len() + 64));
        bytes(&mut opset, 1, b"");
        number(&mut opset, 2, 13);
        number(&mut model, 1, 8);
        bytes(&mut model, 2, b"orator");
        bytes(&mut model, 7, &graph);
        bytes(&mut model, 8, &opset);
        for (key, value) in metadata {
            let mut entry = Vec::new();
            bytes(&mut entry, 1, key.as_bytes());
            bytes(&mut entry, 2, value.as_bytes());
            bytes(&mut model, 14, &entry);
        }
        model
    }
}

fn as_strs(values: &[String]) -> Vec<&str> {
    values.iter().map(String::as_str).collect()
}

fn attribute(name: &str, value: AttributeValue) -> Vec<u8> {
    let mut out = Vec::new();
    bytes(&mut out, 1, name.as_bytes());
    let kind = match value {
        AttributeValue::Float(value) => {
            float(&mut out, 2, value);
            1
        }
        AttributeValue::Int(value) => {
            number(&mut out, 3, value);
            2
        }
        AttributeValue::Text(value) => {
            bytes(&mut out, 4, value.as_bytes());
            3
        }
        AttributeValue::Ints(values) => {
            values.iter().for_each(|value| number(&mut out, 8, *value));
            7
        }
    };
    number(&mut out, 20, kind);
    out
}

/// Declaration of an input or output.
fn port((name, element, axes): GraphPort) -> Vec<u8> {
    let (mut shape, mut tensor, mut kind, mut port) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for axis in axes.split(',') {
        let mut size = Vec::new();
        match axis.parse() {
            Ok(n) => number(&mut size, 1, n),
            Err(_) => bytes(&mut size, 2, axis.as_bytes()),
        }
        bytes(&mut shape, 1, &size);
    }
    number(&mut tensor, 1, element as i64);
    bytes(&mut tensor, 2, &shape);
    bytes(&mut kind, 1, &tensor);
    bytes(&mut port, 1, name.as_bytes());
    bytes(&mut port, 2, &kind);
    port
}
