//! Converts ncnn models: layers over blobs of channels, rows and columns, without a batch axis.

use super::graph::AttributeValue::{Int, Ints, Text};
use super::graph::{ANY_BATCH, ElementType, OnnxGraph};
use super::layout::{SlidingWindow, size};
use super::ncnn_file::{NcnnLayer, NcnnWeights, layers};
use super::source::ConversionOptions;
use anyhow::{Context, Result, bail, ensure};
use orator_base::text::counted;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// Value that means "the rest" in the sizes of a slice.
const REST: f64 = -233.0;

/// A blob: values of the result whose sum it is, each with the factor by which its sides are enlarged, and its shape:
/// channels, rows, columns. A sum is computed when a layer other than an addition or an enlargement reads it.
#[derive(Clone, Debug)]
struct NcnnBlob {
    terms: Vec<(usize, String)>,
    shape: [usize; 3],
}

impl NcnnBlob {
    fn new(name: String, shape: [usize; 3]) -> Self {
        Self { terms: vec![(1, name)], shape }
    }
}

struct NcnnConverter<'a> {
    blobs: BTreeMap<&'a str, NcnnBlob>,
    weights: NcnnWeights<'a>,
    graph: OnnxGraph,
    input: NcnnBlob,
}

/// Converts the model to ONNX; its outputs are the blobs that no layer reads.
pub(crate) fn convert(
    parameters: &[u8],
    weights: &[u8],
    graph: OnnxGraph,
    options: &ConversionOptions,
) -> Result<Vec<u8>> {
    let sizes = options.shape()?;
    let [1, channels, height, width] = sizes[..] else {
        bail!("expected an input of shape [1, channels, height, width], not {sizes:?}")
    };
    let layers = layers(parameters)?;
    let n_inputs = layers.iter().filter(|layer| layer.kind == "Input").count();
    ensure!(n_inputs == 1, "expected 1 layer of type Input, found {n_inputs}");
    let input = NcnnBlob::new(options.input.name.clone(), [channels, height, width]);
    let weights = NcnnWeights::new(weights);
    let mut converter = NcnnConverter { blobs: BTreeMap::new(), weights, graph, input };
    for layer in &layers {
        let layer_name = || format!("layer {:?} ({})", layer.name, layer.kind);
        let outputs = converter.layer(layer).with_context(layer_name)?;
        let [expected, found] = [outputs.len(), layer.outputs.len()];
        ensure!(found == expected, "{} has {}, expected {expected}", layer_name(), counted(found, "output"));
        converter.blobs.extend(layer.outputs.iter().copied().zip(outputs));
    }
    converter.weights.end()?;
    let read: BTreeSet<&str> = layers.iter().flat_map(|layer| layer.inputs.iter().copied()).collect();
    let unread: Vec<&str> =
        layers.iter().flat_map(|layer| &layer.outputs).copied().filter(|blob| !read.contains(blob)).collect();
    ensure!(
        unread.len() == options.outputs.len(),
        "the model has the outputs {unread:?}, but its description names {:?}",
        options.outputs
    );
    let mut ports = Vec::new();
    for (blob, name) in unread.into_iter().zip(&options.outputs).filter(|(_, name)| !name.is_empty()) {
        let (value, [channels, height, width]) = converter.value(blob)?;
        converter.graph.output(name, "Identity", &[&value], &[]);
        ports.push((name.as_str(), [ANY_BATCH, channels, height, width]));
    }
    let ports: Vec<(&str, &[usize])> = ports.iter().map(|(name, shape)| (*name, shape.as_slice())).collect();
    Ok(converter.graph.model(&[(&options.input.name, &[ANY_BATCH, channels, height, width])], &ports))
}

impl<'a> NcnnConverter<'a> {
    fn blob(&self, name: &str) -> Result<NcnnBlob> {
        self.blobs.get(name).cloned().with_context(|| format!("no preceding layer outputs {name:?}"))
    }

    /// Name and shape of a blob, whose sum is computed at first use.
    fn value(&mut self, blob: &'a str) -> Result<(String, [usize; 3])> {
        let NcnnBlob { mut terms, shape } = self.blob(blob)?;
        // Terms of the lowest resolution first, so that each resolution is enlarged once.
        terms.sort_by_key(|(factor, _)| Reverse(*factor));
        let mut terms = terms.into_iter();
        let (mut scale, mut sum) = terms.next().context("the blob has no values")?;
        for (factor, term) in terms {
            sum = self.enlarged(sum, [scale / factor; 2])?;
            sum = self.graph.op("Add", &[&sum, &term], &[]);
            scale = factor;
        }
        let name = self.enlarged(sum, [scale; 2])?;
        self.blobs.insert(blob, NcnnBlob::new(name.clone(), shape));
        Ok((name, shape))
    }

    /// Nearest-neighbour resize of rows and columns by integer factors.
    fn enlarged(&mut self, name: String, factor: [usize; 2]) -> Result<String> {
        let mode = [
            ("mode", Text("nearest")),
            ("coordinate_transformation_mode", Text("asymmetric")),
            ("nearest_mode", Text("floor")),
        ];
        if factor == [1, 1] { Ok(name) } else { self.graph.scaled(&name, factor, &mode) }
    }

    /// Converts a layer and returns one blob per output.
    fn layer(&mut self, layer: &NcnnLayer<'a>) -> Result<Vec<NcnnBlob>> {
        let is_deferred = ["BinaryOp", "Interp"].contains(&layer.kind);
        let inputs = layer.inputs.iter().filter(|_| !is_deferred);
        let inputs = inputs.map(|name| self.value(name)).collect::<Result<Vec<_>>>()?;
        let first = || inputs.first().cloned().context("the layer has no input");
        let result = match layer.kind {
            "Input" => {
                layer.check_keys(&[0, 1, 2])?;
                let stated = [layer.int(2, 0)?, layer.int(1, 0)?, layer.int(0, 0)?];
                let described = self.input.shape;
                let is_consistent =
                    stated.iter().zip(described).all(|(stated, size)| *stated == 0 || *stated == size as i64);
                ensure!(is_consistent, "the input has shape {stated:?}, expected {described:?} as described");
                self.input.clone()
            }
            "Split" => {
                layer.check_keys(&[])?;
                let (name, shape) = first()?;
                return Ok(vec![NcnnBlob::new(name, shape); layer.outputs.len()]);
            }
            "Slice" => return self.slice(layer, first()?),
            "Convolution" | "ConvolutionDepthWise" => self.convolution(layer, first()?)?,
            "ReLU" => {
                layer.check_keys(&[])?;
                let (name, shape) = first()?;
                NcnnBlob::new(self.graph.op("Relu", &[&name], &[]), shape)
            }
            "BinaryOp" => {
                layer.check_keys(&[0])?;
                let [a, b] = layer.inputs[..] else { bail!("expected 2 inputs, found {}", layer.inputs.len()) };
                let (a, b) = (self.blob(a)?, self.blob(b)?);
                ensure!(layer.int(0, 0)? == 0, "unsupported operation {}: expected addition (0)", layer.int(0, 0)?);
                ensure!(a.shape == b.shape, "the shapes of the inputs differ: {:?} and {:?}", a.shape, b.shape);
                NcnnBlob { terms: [a.terms, b.terms].concat(), shape: a.shape }
            }
            "Concat" => self.concatenation(layer, &inputs)?,
            "Reshape" => {
                layer.check_keys(&[0, 1, 2])?;
                let (name, shape) = first()?;
                let new = [size(layer.int(2, 0)?)?, size(layer.int(1, 0)?)?, size(layer.int(0, 0)?)?];
                ensure!(count(new) == count(shape), "cannot reshape {shape:?} to {new:?}");
                NcnnBlob::new(self.graph.reshaped(&name, &new.map(|size| size as i64))?, new)
            }
            "Permute" => {
                layer.check_keys(&[0])?;
                let (name, [channels, height, width]) = first()?;
                ensure!(
                    layer.int(0, 0)? == 2,
                    "unsupported order {}: expected 2 (rows and channels swapped)",
                    layer.int(0, 0)?
                );
                let name = self.graph.op("Transpose", &[&name], &[("perm", Ints(&[0, 2, 1, 3]))]);
                NcnnBlob::new(name, [height, channels, width])
            }
            "Interp" => self.resize(layer)?,
            _ => bail!("unsupported layer type"),
        };
        Ok(vec![result])
    }

    fn slice(&mut self, layer: &NcnnLayer, (name, shape): (String, [usize; 3])) -> Result<Vec<NcnnBlob>> {
        layer.check_keys(&[0, 1])?;
        let axis = axis(layer.int(1, 0)?)?;
        let (parts, mut left, mut sizes) = (layer.list(0), shape[axis], Vec::new());
        for (k, part) in parts.iter().enumerate() {
            let rest = left / (parts.len() - k);
            let part = if *part == REST { rest } else { size(*part as i64)? };
            ensure!(part >= 1 && part <= left, "the slice sizes {parts:?} exceed the axis size {}", shape[axis]);
            left -= part;
            sizes.push(part);
        }
        ensure!(
            left == 0 && !sizes.is_empty(),
            "the slice sizes {parts:?} do not cover {left} of {} elements",
            shape[axis]
        );
        let lengths = self.graph.sizes(&sizes)?;
        let names = self.graph.ops(sizes.len(), "Split", &[&name, &lengths], &[("axis", Int(1 + axis as i64))]);
        let part = |(name, size): (String, usize)| {
            let mut shape = shape;
            shape[axis] = size;
            NcnnBlob::new(name, shape)
        };
        Ok(names.into_iter().zip(sizes).map(part).collect())
    }

    fn concatenation(&mut self, layer: &NcnnLayer, parts: &[(String, [usize; 3])]) -> Result<NcnnBlob> {
        layer.check_keys(&[0])?;
        let axis = axis(layer.int(0, 0)?)?;
        let mut shape = parts.first().context("the layer has no inputs")?.1;
        shape[axis] = 0;
        for (_, part) in parts {
            let mut others = *part;
            others[axis] = shape[axis];
            ensure!(others == shape, "the shapes of the inputs differ: {:?} and {part:?}", parts[0].1);
            shape[axis] = size((shape[axis] + part[axis]) as i64)?;
        }
        let names: Vec<String> = parts.iter().map(|(name, _)| name.clone()).collect();
        Ok(NcnnBlob::new(self.graph.concat(&names, 1 + axis as i64), shape))
    }

    fn convolution(&mut self, layer: &NcnnLayer, (name, shape): (String, [usize; 3])) -> Result<NcnnBlob> {
        layer.check_keys(&[0, 1, 2, 3, 4, 5, 6, 7, 9, 11, 12, 13, 14, 15, 16])?;
        let of = |key: i32, absent: usize| size(layer.int(key, absent as i64)?);
        let channels = of(0, 0)?;
        let group = if layer.kind == "Convolution" { 1 } else { of(7, 1)? };
        ensure!(
            shape[0] % group == 0 && channels % group == 0,
            "cannot split {} input and {channels} output channels into {group} groups",
            shape[0]
        );
        let horizontal = SlidingWindow { kernel: of(1, 0)?, stride: of(3, 1)?, dilation: of(2, 1)? };
        let vertical = SlidingWindow {
            kernel: of(11, horizontal.kernel)?,
            stride: of(13, horizontal.stride)?,
            dilation: of(12, horizontal.dilation)?,
        };
        let left = layer.int(4, 0)?;
        let top = layer.int(14, left)?;
        let pads = [top, left, layer.int(16, top)?, layer.int(15, left)?];
        ensure!(pads.iter().all(|n_zeros| (0..4096).contains(n_zeros)), "invalid padding {pads:?}: expected 0 to 4095");
        let padded = |size: usize, before: i64, after: i64| size + (before + after) as usize;
        let height = vertical.n_steps(padded(shape[1], pads[0], pads[2]))?;
        let width = horizontal.n_steps(padded(shape[2], pads[1], pads[3]))?;

        let dims = [channels, shape[0] / group, vertical.kernel, horizontal.kernel];
        let n_weights = dims.iter().try_fold(1, |product: usize, dim| product.checked_mul(*dim));
        ensure!(
            n_weights.is_some_and(|n| layer.int(6, 0).is_ok_and(|stated| stated == n as i64)),
            "a weight of shape {dims:?} cannot have {} values",
            layer.int(6, 0)?
        );
        let (element, weight) = self.weights.tagged(n_weights.unwrap_or_default())?;
        // ONNX Runtime pads the channels of 2-D convolutions to a multiple of 16. For a product of few channels this
        // takes half as long again as a 1-D convolution, which it does not pad.
        let is_narrow = dims[2..] == [1, 1]
            && [vertical.stride, horizontal.stride, group] == [1; 3]
            && pads == [0; 4]
            && (channels < 32 && channels % 16 != 0);
        let mut inputs = if is_narrow {
            vec![self.graph.reshaped(&name, &[shape[0] as i64, -1])?, self.graph.constant(element, &dims[..3], weight)?]
        } else {
            vec![name, self.graph.constant(element, &dims, weight)?]
        };
        if layer.int(5, 0)? != 0 {
            let bias = self.weights.plain(channels)?;
            inputs.push(self.graph.constant(ElementType::F32, &[channels], bias)?);
        }
        let mut name = if is_narrow {
            let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
            self.graph.op("Conv", &inputs, &[("kernel_shape", Ints(&[1]))])
        } else {
            self.graph.windowed(&inputs, [vertical, horizontal], pads, Some(group), true)
        };
        match layer.int(9, 0)? {
            0 => {}
            1 => name = self.graph.op("Relu", &[&name], &[]),
            other => bail!("unsupported activation {other}: expected none (0) or ReLU (1)"),
        }
        let shape = [channels, height, width];
        if is_narrow {
            name = self.graph.reshaped(&name, &shape.map(|size| size as i64))?;
        }
        Ok(NcnnBlob::new(name, shape))
    }

    /// Nearest-neighbour resize by an integer factor, or bilinear resize with aligned corners.
    fn resize(&mut self, layer: &NcnnLayer<'a>) -> Result<NcnnBlob> {
        layer.check_keys(&[0, 1, 2, 3, 4, 6])?;
        let stated = [size(layer.int(3, 0)?.max(1))?, size(layer.int(4, 0)?.max(1))?];
        let factor = [size(layer.int(1, 1)?)?, size(layer.int(2, 1)?)?];
        let input = *layer.inputs.first().context("the layer has no input")?;
        let NcnnBlob { mut terms, shape } = self.blob(input)?;
        match (layer.int(0, 0)?, layer.int(3, 0)?, layer.int(6, 0)?) {
            (1, 0, 0) => {
                let sides = [size((shape[1] * factor[0]) as i64)?, size((shape[2] * factor[1]) as i64)?];
                if factor[0] == factor[1] && factor[0].is_power_of_two() {
                    terms.iter_mut().for_each(|(scale, _)| *scale *= factor[0]);
                } else {
                    let name = self.value(input)?.0;
                    terms = vec![(1, self.enlarged(name, factor)?)];
                }
                Ok(NcnnBlob { terms, shape: [shape[0], sides[0], sides[1]] })
            }
            (2, 1.., 1) if stated[0] % shape[1] == 0 && stated[1] % shape[2] == 0 => {
                let mode = [("mode", Text("linear")), ("coordinate_transformation_mode", Text("align_corners"))];
                let name = self.value(input)?.0;
                let name = self.graph.scaled(&name, [stated[0] / shape[1], stated[1] / shape[2]], &mode)?;
                Ok(NcnnBlob::new(name, [shape[0], stated[0], stated[1]]))
            }
            (kind, _, _) => bail!(
                "unsupported resize {kind}: expected nearest (1) by a factor, or bilinear (2) to multiples of the sides \
                 with aligned corners"
            ),
        }
    }
}

/// Checks an axis index: channels, rows or columns.
fn axis(number: i64) -> Result<usize> {
    usize::try_from(number)
        .ok()
        .filter(|axis| *axis < 3)
        .with_context(|| format!("invalid axis {number}: expected 0, 1 or 2"))
}

fn count(shape: [usize; 3]) -> Option<usize> {
    shape[0].checked_mul(shape[1])?.checked_mul(shape[2])
}
