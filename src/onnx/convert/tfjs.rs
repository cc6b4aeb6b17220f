//! Converts TensorFlow.js graph nodes to ONNX operators: all nodes on which a requested node depends, each once. Images
//! that are channels last in TensorFlow are channels first in the result; transpositions between the two are free.

use super::graph::AttributeValue::{Float, Text};
use super::graph::{ElementType, OnnxGraph};
use super::layout::{CHANNELS_FIRST, SlidingWindow, four, size};
use super::tfjs_file::{TfGraph, TfNode, TfTensor};
use anyhow::{Context, Result, bail, ensure};
use std::collections::{BTreeMap, BTreeSet};

/// Output of a node: its name in the result, and its shape in TensorFlow.
#[derive(Clone, Debug)]
pub(crate) struct TfValue {
    pub name: String,
    pub shape: Vec<usize>,
    /// Whether it is NHWC in TensorFlow and NCHW in the result.
    pub channels_first: bool,
}

pub(crate) struct TfConverter<'a> {
    pub source: &'a TfGraph<'a>,
    pub graph: OnnxGraph,
    values: BTreeMap<String, TfValue>,
}

impl<'a> TfConverter<'a> {
    /// Creates a converter in which the node `name` already has the value `value`.
    pub(crate) fn new(source: &'a TfGraph<'a>, graph: OnnxGraph, name: &str, value: TfValue) -> Self {
        Self { source, graph, values: BTreeMap::from([(name.to_owned(), value)]) }
    }

    /// Adds a weight, with its axes reordered by `order` or reshaped to `dims`.
    pub(crate) fn weight(
        &mut self,
        tensor: &TfTensor,
        order: Option<[usize; 4]>,
        dims: Option<&[usize]>,
    ) -> Result<String> {
        ensure!(tensor.element != ElementType::I32, "unsupported weight type int32: expected float16 or float32");
        self.graph.weight((tensor.element, &tensor.shape, tensor.raw), order, dims)
    }

    /// Output of the node `target`, after conversion of all nodes on which it depends. Errors: a node is missing,
    /// depends on itself, or is of an unsupported kind.
    pub(crate) fn value(&mut self, target: &str) -> Result<TfValue> {
        let source = self.source;
        let (mut stack, mut visited) = (vec![target], BTreeSet::new());
        while let Some(name) = stack.last().copied() {
            if self.values.contains_key(name) {
                stack.pop();
                continue;
            }
            let node = source.nodes.get(name).with_context(|| format!("missing node {name:?}"))?;
            let missing = |input: &&str| !source.tensors.contains_key(*input) && !self.values.contains_key(*input);
            let missing: Vec<&str> = node.inputs.iter().map(String::as_str).filter(missing).collect();
            if missing.is_empty() {
                let value = self.node(node).with_context(|| format!("node {name:?} ({})", node.op))?;
                self.values.insert(name.to_owned(), value);
                stack.pop();
            } else {
                ensure!(visited.insert(name), "node {name:?} depends on its own result");
                stack.extend(missing);
            }
        }
        self.values.get(target).cloned().context("the node has no result")
    }

    fn input(&self, node: &TfNode, k: usize) -> Result<TfValue> {
        let name = node.inputs.get(k).with_context(|| format!("input {k} is missing"))?;
        self.values.get(name).cloned().with_context(|| format!("input {k} ({name:?}) must be the result of a node"))
    }

    /// The first input, which must be an image, with its height, width and channels.
    fn picture(&self, node: &TfNode) -> Result<(TfValue, [usize; 3])> {
        let value = self.input(node, 0)?;
        let [_, height, width, channels] = four("the input", &value.shape)?;
        ensure!(value.channels_first, "the input must be an image in NHWC order");
        Ok((value, [height, width, channels]))
    }

    fn constant(&self, node: &TfNode, k: usize) -> Result<&'a TfTensor<'a>> {
        let name = node.inputs.get(k).with_context(|| format!("input {k} is missing"))?;
        self.source.tensor(name).with_context(|| format!("input {k}"))
    }

    fn node(&mut self, node: &TfNode) -> Result<TfValue> {
        match node.op.as_str() {
            "Conv2D" | "_FusedConv2D" => self.convolution(node, false),
            "DepthwiseConv2dNative" | "FusedDepthwiseConv2dNative" => self.convolution(node, true),
            "Add" | "AddV2" => self.elementwise(node, "Add"),
            "Sub" => self.elementwise(node, "Sub"),
            "Mul" => self.elementwise(node, "Mul"),
            "LeakyRelu" => {
                let (value, alpha) = (self.input(node, 0)?, node.number("alpha")?);
                let name = self.graph.op("LeakyRelu", &[&value.name], &[("alpha", Float(alpha))]);
                Ok(TfValue { name, ..value })
            }
            "MaxPool" => {
                let (value, [height, width, channels]) = self.picture(node)?;
                let windows = windows(node, height_and_width(&node.integers("ksize")?)?)?;
                let (pads, height, width) = padding(node, windows, [height, width])?;
                let name = self.graph.windowed(std::slice::from_ref(&value.name), windows, pads, None, false);
                Ok(TfValue { name, shape: vec![value.shape[0], height, width, channels], ..value })
            }
            "Pad" | "PadV2" => self.pad(node),
            "Transpose" => self.transpose(node),
            "ConcatV2" => self.concatenation(node),
            "ResizeBilinear" => {
                let (value, [height, width, channels]) = self.picture(node)?;
                ensure!(
                    node.is("half_pixel_centers") && !node.is("align_corners"),
                    "unsupported resize: expected half_pixel_centers without align_corners"
                );
                let [new_height, new_width] = self.constant(node, 1)?.integers()?[..] else {
                    bail!("expected a size of 2 numbers")
                };
                let (new_height, new_width) = (size(new_height)?, size(new_width)?);
                let scales = [1.0, 1.0, new_height as f64 / height as f64, new_width as f64 / width as f64];
                let scales = self.graph.floats(&[4], &scales.map(|scale| scale as f32))?;
                let mode = [("mode", Text("linear")), ("coordinate_transformation_mode", Text("half_pixel"))];
                let name = self.graph.op("Resize", &[&value.name, "", &scales], &mode);
                Ok(TfValue { name, shape: vec![value.shape[0], new_height, new_width, channels], ..value })
            }
            _ => bail!("unsupported node type"),
        }
    }

    fn convolution(&mut self, node: &TfNode, depthwise: bool) -> Result<TfValue> {
        let (value, [height, width, channels]) = self.picture(node)?;
        let weight = self.constant(node, 1)?;
        let [kernel_height, kernel_width, n_inputs, n_outputs] = four("the weight", &weight.shape)?;
        let windows = windows(node, [kernel_height, kernel_width])?;
        ensure!(
            n_inputs == channels && (!depthwise || n_outputs == 1) && weight.raw.len() > 1,
            "a weight of shape {:?} does not match {channels} channels",
            weight.shape
        );
        ensure!(
            node.integers("dilations").unwrap_or_default().iter().all(|step| *step == 1),
            "dilations are not supported"
        );
        let (pads, height, width) = padding(node, windows, [height, width])?;
        let order = if depthwise { [2, 3, 0, 1] } else { [3, 2, 0, 1] };
        let mut inputs = vec![value.name.clone(), self.weight(weight, Some(order), None)?];
        for k in 2..node.inputs.len() {
            inputs.push(self.weight(self.constant(node, k)?, None, None)?);
        }
        let group = if depthwise { channels } else { 1 };
        let mut name = self.graph.windowed(&inputs, windows, pads, Some(group), false);
        let fused = node.texts("fused_ops")?;
        let fused: Vec<&str> = fused.iter().map(String::as_str).collect();
        ensure!(
            fused.contains(&"BiasAdd") == (inputs.len() == 3) && inputs.len() <= 3,
            "a fused BiasAdd must have 1 input"
        );
        match fused.as_slice() {
            [] | ["BiasAdd"] => {}
            ["BiasAdd", "Relu"] => name = self.graph.op("Relu", &[&name], &[]),
            ["BiasAdd", "Relu6"] => name = self.graph.relu6(&name)?,
            _ => bail!("unsupported fused operators {fused:?}"),
        }
        let channels = if depthwise { channels } else { n_outputs };
        Ok(TfValue { name, shape: vec![value.shape[0], height, width, channels], channels_first: true })
    }

    /// Combines two outputs of the same shape, or one with a broadcast constant.
    fn elementwise(&mut self, node: &TfNode, kind: &str) -> Result<TfValue> {
        let [a, b] = node.inputs.as_slice() else { bail!("expected 2 inputs, found {}", node.inputs.len()) };
        let (mut names, mut result) = (Vec::new(), None::<TfValue>);
        for input in [a, b] {
            if let Some(value) = self.values.get(input) {
                let is_same_shape = result
                    .as_ref()
                    .is_none_or(|other| (&other.shape, other.channels_first) == (&value.shape, value.channels_first));
                ensure!(
                    is_same_shape,
                    "the shapes of the inputs differ: {:?} and {:?}",
                    result.map(|other| other.shape).unwrap_or_default(),
                    value.shape
                );
                result = Some(value.clone());
            }
        }
        let result = result.context("both inputs are constants")?;
        for input in [a, b] {
            names.push(match self.source.tensors.get(input) {
                Some(tensor) => self.broadcast(tensor, &result)?,
                None => self.values.get(input).map(|value| value.name.clone()).unwrap_or_default(),
            });
        }
        let name = self.graph.op(kind, &[&names[0], &names[1]], &[]);
        Ok(TfValue { name, ..result })
    }

    /// Adds a constant that broadcasts to `value`: its axes are the last ones of `value`, of equal size or 1.
    fn broadcast(&mut self, tensor: &TfTensor, value: &TfValue) -> Result<String> {
        let is_compatible = tensor.shape.len() <= value.shape.len()
            && tensor.shape.iter().rev().zip(value.shape.iter().rev()).all(|(size, full)| *size == 1 || size == full);
        ensure!(is_compatible, "cannot broadcast a constant of shape {:?} to {:?}", tensor.shape, value.shape);
        match tensor.shape.as_slice() {
            [channels] if value.channels_first => self.weight(tensor, None, Some(&[*channels, 1, 1])),
            [_, _, _, _] if value.channels_first => self.weight(tensor, Some(CHANNELS_FIRST), None),
            [_, ..] if value.channels_first => bail!("unsupported constant of shape {:?}", tensor.shape),
            _ => self.weight(tensor, None, None),
        }
    }

    fn pad(&mut self, node: &TfNode) -> Result<TfValue> {
        let mut value = self.input(node, 0)?;
        let pads = self.constant(node, 1)?.integers()?;
        let n_axes = value.shape.len();
        ensure!(pads.len() == 2 * n_axes, "expected 2 padding values for each of {n_axes} axes, found {}", pads.len());
        for (dim, pads) in value.shape.iter_mut().zip(pads.chunks_exact(2)) {
            ensure!(pads[0] >= 0 && pads[1] >= 0, "negative padding {pads:?}");
            *dim = size(*dim as i64 + pads[0] + pads[1])?;
        }
        if pads.iter().all(|n_cells| *n_cells == 0) {
            return Ok(value);
        }
        let order: Vec<usize> = if value.channels_first { CHANNELS_FIRST.to_vec() } else { (0..n_axes).collect() };
        let (before, after) = (order.iter().map(|axis| pads[2 * axis]), order.iter().map(|axis| pads[2 * axis + 1]));
        let pads = self.graph.ints(&before.chain(after).collect::<Vec<_>>())?;
        let mut inputs = vec![value.name.clone(), pads];
        if node.op == "PadV2" {
            inputs.push(self.weight(self.constant(node, 2)?, None, Some(&[]))?);
        }
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        value.name = self.graph.op("Pad", &inputs, &[("mode", Text("constant"))]);
        Ok(value)
    }

    fn transpose(&mut self, node: &TfNode) -> Result<TfValue> {
        let value = self.input(node, 0)?;
        let order = self.constant(node, 1)?.integers()?;
        let shape = four("the input", &value.shape)?;
        match (order.as_slice(), value.channels_first) {
            ([0, 3, 1, 2], true) => {
                Ok(TfValue { shape: CHANNELS_FIRST.map(|axis| shape[axis]).to_vec(), channels_first: false, ..value })
            }
            ([0, 2, 3, 1], false) => {
                Ok(TfValue { shape: [0, 2, 3, 1].map(|axis| shape[axis]).to_vec(), channels_first: true, ..value })
            }
            _ => bail!("unsupported transpose {order:?}: expected NHWC to NCHW or back"),
        }
    }

    fn concatenation(&mut self, node: &TfNode) -> Result<TfValue> {
        let n_parts = node.inputs.len().saturating_sub(1);
        let parts = (0..n_parts).map(|k| self.input(node, k)).collect::<Result<Vec<_>>>()?;
        let [axis] = self.constant(node, n_parts)?.integers()?[..] else { bail!("expected 1 axis") };
        let mut result = parts.first().context("the node has no inputs")?.clone();
        let n_axes = result.shape.len() as i64;
        ensure!((-n_axes..n_axes).contains(&axis), "axis {axis} is out of range for {n_axes} axes");
        let axis = axis.rem_euclid(n_axes) as usize;
        let mut total = 0;
        for part in &parts {
            let mut shape = part.shape.clone();
            total += shape.get(axis).copied().unwrap_or_default();
            if let Some(dim) = shape.get_mut(axis) {
                *dim = result.shape[axis];
            }
            ensure!(
                shape == result.shape && part.channels_first == result.channels_first,
                "the shapes of the inputs differ: {:?} and {:?}",
                result.shape,
                part.shape
            );
        }
        result.shape[axis] = size(total as i64)?;
        let axis = if result.channels_first { [0, 2, 3, 1][axis] } else { axis as i64 };
        let names: Vec<String> = parts.into_iter().map(|part| part.name).collect();
        result.name = self.graph.concat(&names, axis);
        Ok(result)
    }
}

/// Height and width entries of four numbers in NHWC order.
fn height_and_width(numbers: &[i64]) -> Result<[usize; 2]> {
    let [1, height, width, 1] = *numbers else { bail!("expected [1, height, width, 1], not {numbers:?}") };
    Ok([size(height)?, size(width)?])
}

/// Windows over height and width.
fn windows(node: &TfNode, kernel: [usize; 2]) -> Result<[SlidingWindow; 2]> {
    let strides = height_and_width(&node.integers("strides")?)?;
    let kernel = [size(kernel[0] as i64)?, size(kernel[1] as i64)?];
    Ok([0, 1].map(|axis| SlidingWindow { kernel: kernel[axis], stride: strides[axis], dilation: 1 }))
}

/// Zeros at the top, left, bottom and right, and the height and width of the result.
fn padding(node: &TfNode, windows: [SlidingWindow; 2], sizes: [usize; 2]) -> Result<([i64; 4], usize, usize)> {
    let pads = match node.text("padding")?.as_str() {
        "SAME" => [0, 1].map(|axis| windows[axis].same_padding(sizes[axis])),
        "VALID" => [(0, 0); 2],
        other => bail!("unsupported padding {other:?}: expected SAME or VALID"),
    };
    let n_steps = |axis: usize| windows[axis].n_steps(sizes[axis] + pads[axis].0 + pads[axis].1);
    let zeros = [pads[0].0, pads[1].0, pads[0].1, pads[1].1].map(|n_zeros| n_zeros as i64);
    Ok((zeros, n_steps(0)?, n_steps(1)?))
}
