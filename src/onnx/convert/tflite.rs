//! Converts TFLite models: a flatbuffer of tensors, buffers and operators in order. 4-D results are channels first.

use super::flatbuffer::FlatTable;
use super::graph::AttributeValue::{Int, Ints, Text};
use super::graph::{ANY_BATCH, ElementType, OnnxGraph};
use super::layout::{CHANNELS_FIRST, SlidingWindow, four, int32s, size};
use super::source::ConversionOptions;
use anyhow::{Context, Result, bail, ensure};
use std::collections::{BTreeMap, BTreeSet};

/// Maximum number of axes of a tensor, and of inputs of an operator.
const MAX_AXES: usize = 6;
const MAX_INPUTS: usize = 64;

/// Bytes of a constant, and TFLite's number for its element type.
#[derive(Clone, Copy)]
struct Constant<'a> {
    raw: &'a [u8],
    element: i8,
}

struct TfliteOperator<'a> {
    code: i32,
    inputs: Vec<i32>,
    output: usize,
    options: Option<FlatTable<'a>>,
}

struct TfliteConverter<'a> {
    /// Shapes of the tensors.
    shapes: Vec<Vec<usize>>,
    constants: BTreeMap<usize, Constant<'a>>,
    /// Names of operator outputs in the graph, by tensor.
    values: BTreeMap<usize, String>,
    graph: OnnxGraph,
}

pub(crate) fn convert(file: &[u8], graph: OnnxGraph, options: &ConversionOptions) -> Result<Vec<u8>> {
    let model = FlatTable::root(file)?;
    let code = |code: FlatTable| Ok(code.int(3, 0)?.max(i32::from(code.byte(0)?)));
    let codes: Vec<i32> = model.tables(1)?.into_iter().map(code).collect::<Result<_>>()?;
    let network = model.tables(2)?.into_iter().next().context("the file contains no graph")?;
    let buffers = model.tables(4)?;
    let (mut shapes, mut constants) = (Vec::<Vec<usize>>::new(), BTreeMap::new());
    for (k, tensor) in network.tables(0)?.into_iter().enumerate() {
        let shape = tensor.ints(0, MAX_AXES)?.into_iter().map(|dim| size(dim.into())).collect::<Result<_>>();
        shapes.push(shape.with_context(|| format!("tensor {k}"))?);
        let buffer = usize::try_from(tensor.int(2, 0)?).ok().and_then(|buffer| buffers.get(buffer));
        let raw = buffer
            .with_context(|| format!("invalid buffer of tensor {k}: the file has {}", buffers.len()))?
            .bytes(0)?;
        if !raw.is_empty() {
            constants.insert(k, Constant { raw, element: tensor.byte(1)? });
        }
    }
    let index = |tensor: i32| {
        let found = usize::try_from(tensor).ok().filter(|tensor| *tensor < shapes.len());
        found.with_context(|| format!("invalid tensor {tensor}: the file has {}", shapes.len()))
    };
    let outputs = network.ints(2, MAX_INPUTS)?.into_iter().map(index).collect::<Result<Vec<_>>>()?;
    ensure!(
        outputs.len() == options.outputs.len(),
        "the model has {} outputs, but its description names {:?}",
        outputs.len(),
        options.outputs
    );
    let named: Vec<(usize, &str)> = outputs.into_iter().zip(options.outputs.iter().map(String::as_str)).collect();
    let named: Vec<(usize, &str)> = named.into_iter().filter(|(_, name)| !name.is_empty()).collect();
    let first = index(network.ints(1, MAX_INPUTS)?.first().copied().context("the model has no input")?)?;

    let mut operators = Vec::new();
    for (k, operator) in network.tables(3)?.into_iter().enumerate() {
        let code = usize::try_from(operator.int(0, 0)?).ok().and_then(|code| codes.get(code));
        let code = *code.with_context(|| format!("invalid code of operator {k}: the file has {}", codes.len()))?;
        let outputs = operator.ints(2, MAX_INPUTS)?;
        let [output] = outputs.as_slice() else {
            bail!("operator {k} ({}) has {} outputs, expected 1", kind(code), outputs.len())
        };
        let inputs = operator.ints(1, MAX_INPUTS)?;
        operators.push(TfliteOperator { code, inputs, output: index(*output)?, options: operator.table(4)? });
    }
    // Only operators on which the named outputs depend are converted.
    let mut needed: BTreeSet<usize> = named.iter().map(|(tensor, _)| *tensor).collect();
    let mut used = vec![false; operators.len()];
    for (used, operator) in used.iter_mut().zip(&operators).rev() {
        *used = needed.contains(&operator.output);
        if *used {
            needed.extend(operator.inputs.iter().filter_map(|input| usize::try_from(*input).ok()));
        }
    }

    let shape = shapes[first].clone();
    ensure!(
        shape.len() == 4 && shape == options.shape()?,
        "the input has shape {shape:?}, expected {:?} as described",
        options.input.shape
    );
    let mut converter = TfliteConverter { shapes, constants, values: BTreeMap::new(), graph };
    let image = converter.graph.op("Transpose", &[&options.input.name], &[("perm", Ints(&[0, 3, 1, 2]))]);
    converter.values.insert(first, image);
    for (k, (operator, _)) in operators.iter().zip(used).enumerate().filter(|(_, (_, used))| *used) {
        converter.operator(operator).with_context(|| format!("operator {k} ({})", kind(operator.code)))?;
    }
    let mut ports = Vec::new();
    for (tensor, name) in named {
        let (value, shape) = (converter.value(tensor)?, converter.shapes[tensor].clone());
        match shape.len() {
            4 => converter.graph.output(name, "Transpose", &[&value], &[("perm", Ints(&[0, 2, 3, 1]))]),
            _ => converter.graph.output(name, "Identity", &[&value], &[]),
        }
        ports.push((name, with_any_batch(shape)));
    }
    let ports: Vec<(&str, &[usize])> = ports.iter().map(|(name, shape)| (*name, shape.as_slice())).collect();
    Ok(converter.graph.model(&[(&options.input.name, &with_any_batch(shape))], &ports))
}

/// Shape of a value that has one entry per image; other shapes are unchanged.
fn with_any_batch(mut shape: Vec<usize>) -> Vec<usize> {
    shape.first_mut().filter(|size| **size == 1).into_iter().for_each(|size| *size = ANY_BATCH);
    shape
}

/// TFLite's name for an operator.
fn kind(code: i32) -> String {
    let known = match code {
        0 => "ADD",
        2 => "CONCATENATION",
        3 => "CONV_2D",
        4 => "DEPTHWISE_CONV_2D",
        6 => "DEQUANTIZE",
        9 => "FULLY_CONNECTED",
        14 => "LOGISTIC",
        17 => "MAX_POOL_2D",
        22 => "RESHAPE",
        23 => "RESIZE_BILINEAR",
        34 => "PAD",
        40 => "MEAN",
        54 => "PRELU",
        _ => return format!("builtin operator {code}"),
    };
    known.to_owned()
}

impl<'a> TfliteConverter<'a> {
    fn value(&self, tensor: usize) -> Result<String> {
        self.values.get(&tensor).cloned().with_context(|| format!("no preceding operator outputs tensor {tensor}"))
    }

    /// The value in TFLite's layout, channels last.
    fn channels_last(&mut self, tensor: usize) -> Result<String> {
        let value = self.value(tensor)?;
        match self.shapes[tensor].as_slice() {
            [_, 1, 1, _] => Ok(value),
            [_, _, _, _] => Ok(self.graph.op("Transpose", &[&value], &[("perm", Ints(&[0, 2, 3, 1]))])),
            _ => Ok(value),
        }
    }

    fn constant_of(&self, tensor: usize) -> Result<Constant<'a>> {
        self.constants.get(&tensor).copied().with_context(|| format!("tensor {tensor} has no constant values"))
    }

    /// Adds a weight, with its axes reordered by `order` or reshaped to `dims`.
    fn weight(&mut self, tensor: usize, order: Option<[usize; 4]>, dims: Option<&[usize]>) -> Result<String> {
        let Constant { raw, element } = self.constant_of(tensor)?;
        let element = match element {
            0 => ElementType::F32,
            1 => ElementType::F16,
            _ => bail!("tensor {tensor} has TFLite type {element}, expected float32 (0) or float16 (1)"),
        };
        self.graph.weight((element, &self.shapes[tensor], raw), order, dims)
    }

    fn integers(&self, tensor: usize) -> Result<Vec<i64>> {
        let Constant { raw, element } = self.constant_of(tensor)?;
        ensure!(
            element == 2 && raw.len() <= 8 * 2 * MAX_AXES,
            "tensor {tensor}: expected at most {} values of type int32",
            4 * MAX_AXES
        );
        Ok(int32s(raw).map(i64::from).collect())
    }

    /// Applies the activation that is fused with an operator.
    fn activate(&mut self, value: String, activation: i8) -> Result<String> {
        match activation {
            0 => Ok(value),
            1 => Ok(self.graph.op("Relu", &[&value], &[])),
            3 => self.graph.relu6(&value),
            _ => bail!("unsupported activation {activation}: expected none (0), RELU (1) or RELU6 (3)"),
        }
    }

    fn operator(&mut self, operator: &TfliteOperator) -> Result<()> {
        let n_tensors = self.shapes.len();
        let input = |k: usize| {
            let tensor = operator.inputs.get(k).and_then(|tensor| usize::try_from(*tensor).ok());
            tensor.filter(|tensor| *tensor < n_tensors)
        };
        let needed = |k: usize| input(k).with_context(|| format!("input {k} is missing"));
        let first = needed(0)?;
        let options = || operator.options.context("the options are missing");
        let fused = |field: usize| operator.options.map_or(Ok(0), |options| options.byte(field));
        let output = self.shapes[operator.output].clone();
        let value = match operator.code {
            0 => {
                let (a, b) = (self.value(first)?, self.value(needed(1)?)?);
                let sum = self.graph.op("Add", &[&a, &b], &[]);
                self.activate(sum, fused(0)?)?
            }
            2 => {
                let axis = options()?.int(0, 0)?.rem_euclid(output.len().max(1) as i32) as usize;
                let axis = if output.len() == 4 { [0, 2, 3, 1][axis] } else { axis as i64 };
                let parts = (0..operator.inputs.len()).map(|k| self.value(needed(k)?)).collect::<Result<Vec<_>>>()?;
                self.graph.concat(&parts, axis)
            }
            3 | 4 => self.convolution(operator.code == 4, first, needed(1)?, input(2), options()?)?,
            6 => {
                let constant = self.constant_of(first)?;
                self.constants.insert(operator.output, constant);
                return Ok(());
            }
            9 => {
                let weight = needed(1)?;
                let [_, n_inputs] = self.shapes[weight][..] else { bail!("expected a weight with 2 axes") };
                let flat = self.channels_last(first)?;
                let shape = self.graph.ints(&[-1, n_inputs as i64])?;
                let flat = self.graph.op("Reshape", &[&flat, &shape], &[]);
                let mut inputs = vec![flat, self.weight(weight, None, None)?];
                if let Some(bias) = input(2) {
                    inputs.push(self.weight(bias, None, None)?);
                }
                let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
                let product = self.graph.op("Gemm", &inputs, &[("transB", Int(1))]);
                let product = self.activate(product, fused(0)?)?;
                if output.len() == 2 { product } else { self.reshape(&product, &output)? }
            }
            14 => {
                let value = self.value(first)?;
                self.graph.op("Sigmoid", &[&value], &[])
            }
            17 => self.max_pool(first, options()?)?,
            22 => {
                let value = self.channels_last(first)?;
                let value = self.reshape(&value, &output)?;
                match output.len() {
                    4 => self.graph.op("Transpose", &[&value], &[("perm", Ints(&[0, 3, 1, 2]))]),
                    _ => value,
                }
            }
            23 => self.resize(first, &output, [options()?.byte(2)?, options()?.byte(3)?])?,
            34 => {
                let pads = self.integers(needed(1)?)?;
                ensure!(pads.len() == 8, "expected 2 padding values for each of 4 axes, found {}", pads.len());
                let ends = CHANNELS_FIRST.map(|axis| 2 * axis).into_iter();
                let pads: Vec<i64> = ends.clone().map(|k| pads[k]).chain(ends.map(|k| pads[k + 1])).collect();
                let (value, pads) = (self.value(first)?, self.graph.ints(&pads)?);
                self.graph.op("Pad", &[&value, &pads], &[("mode", Text("constant"))])
            }
            40 => {
                let mut axes: Vec<i64> = self.integers(needed(1)?)?.iter().map(|axis| axis.rem_euclid(4)).collect();
                axes.sort_unstable();
                let n_axes = self.shapes[first].len();
                ensure!(
                    axes == [1, 2] && n_axes == 4,
                    "unsupported mean over the axes {axes:?}: expected height and width ([1, 2])"
                );
                let keep = i64::from(fused(0)? != 0);
                let value = self.value(first)?;
                self.graph.op("ReduceMean", &[&value], &[("axes", Ints(&[2, 3])), ("keepdims", Int(keep))])
            }
            54 => {
                let slope = needed(1)?;
                let channels = *self.shapes[slope].last().context("the slope has no axes")?;
                let (value, slope) = (self.value(first)?, self.weight(slope, None, Some(&[channels, 1, 1, 1]))?);
                self.parametric_relu(value, slope, channels)?
            }
            _ => bail!("unsupported operator"),
        };
        self.values.insert(operator.output, value);
        Ok(())
    }

    /// Bilinear enlargement to the size of `output`; `flags`: whether corners and half pixel centres are aligned.
    fn resize(&mut self, input: usize, output: &[usize], flags: [i8; 2]) -> Result<String> {
        let mode = match flags {
            [0, 0] => "asymmetric",
            [0, _] => "half_pixel",
            _ => "align_corners",
        };
        let [_, height, width, _] = four("the output", output)?;
        let (value, [_, old_height, old_width, _]) = (self.value(input)?, four("the input", &self.shapes[input])?);
        ensure!(
            height % old_height == 0 && width % old_width == 0,
            "unsupported resize of {old_height}x{old_width} to {height}x{width}: expected integer factors"
        );
        let mode = [("mode", Text("linear")), ("coordinate_transformation_mode", Text(mode))];
        self.graph.scaled(&value, [height / old_height, width / old_width], &mode)
    }

    /// `slope * x + (1 - slope) * max(x, 0)` as depthwise convolutions: ONNX Runtime computes them in the layout of the
    /// neighbouring convolutions, and takes a third of the time of its own operator.
    fn parametric_relu(&mut self, value: String, slope: String, channels: usize) -> Result<String> {
        let one = self.graph.floats(&[], &[1.0])?;
        let rest = self.graph.op("Sub", &[&one, &slope], &[]);
        let positive = self.graph.op("Relu", &[&value], &[]);
        let point = SlidingWindow { kernel: 1, stride: 1, dilation: 1 };
        let mut scaled = |inputs: [String; 2]| self.graph.windowed(&inputs, [point; 2], [0; 4], Some(channels), false);
        let [linear, positive] = [scaled([value, slope]), scaled([positive, rest])];
        Ok(self.graph.op("Add", &[&linear, &positive], &[]))
    }

    fn reshape(&mut self, value: &str, shape: &[usize]) -> Result<String> {
        if let [1, entry @ ..] = shape {
            return self.graph.reshaped(value, &entry.iter().map(|size| *size as i64).collect::<Vec<_>>());
        }
        let shape = self.graph.sizes(shape)?;
        Ok(self.graph.op("Reshape", &[value, &shape], &[]))
    }

    fn convolution(
        &mut self,
        depthwise: bool,
        image: usize,
        weight: usize,
        bias: Option<usize>,
        options: FlatTable,
    ) -> Result<String> {
        let dilations = if depthwise { 5 } else { 4 };
        let [_, height, width, channels] = four("the input", &self.shapes[image])?;
        let [_, kernel_height, kernel_width, _] = four("the weight", &self.shapes[weight])?;
        let window = |kernel, stride, dilation| -> Result<_> {
            let [stride, dilation] = [size(options.int(stride, 1)?.into())?, size(options.int(dilation, 1)?.into())?];
            Ok(SlidingWindow { kernel, stride, dilation })
        };
        let [vertical, horizontal] = [window(kernel_height, 2, dilations + 1)?, window(kernel_width, 1, dilations)?];
        let pads = padding(options, [(vertical, height), (horizontal, width)])?;
        let order = if depthwise { [3, 0, 1, 2] } else { CHANNELS_FIRST };
        let mut inputs = vec![self.value(image)?, self.weight(weight, Some(order), None)?];
        if let Some(bias) = bias {
            inputs.push(self.weight(bias, None, None)?);
        }
        let result = self.graph.windowed(
            &inputs,
            [vertical, horizontal],
            pads,
            Some(if depthwise { channels } else { 1 }),
            true,
        );
        self.activate(result, options.byte(if depthwise { 4 } else { 3 })?)
    }

    fn max_pool(&mut self, image: usize, options: FlatTable) -> Result<String> {
        let [_, height, width, _] = four("the input", &self.shapes[image])?;
        let window = |kernel, stride| -> Result<_> {
            let [kernel, stride] = [size(options.int(kernel, 0)?.into())?, size(options.int(stride, 0)?.into())?];
            Ok(SlidingWindow { kernel, stride, dilation: 1 })
        };
        let [vertical, horizontal] = [window(4, 2)?, window(3, 1)?];
        let pads = padding(options, [(vertical, height), (horizontal, width)])?;
        let value = self.value(image)?;
        let pooled = self.graph.windowed(&[value], [vertical, horizontal], pads, None, false);
        self.activate(pooled, options.byte(5)?)
    }
}

/// Zeros at top, left, bottom and right for SAME or VALID padding of a window over each axis, given with axis sizes.
fn padding(options: FlatTable, windows: [(SlidingWindow, usize); 2]) -> Result<[i64; 4]> {
    let is_same_padding = options.byte(0)? == 0;
    let [(top, bottom), (left, right)] =
        windows.map(|(window, size)| if is_same_padding { window.same_padding(size) } else { (0, 0) });
    Ok([top, left, bottom, right].map(|n_zeros| n_zeros as i64))
}
