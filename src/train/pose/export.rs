//! A trained body network as an ONNX file that is fed and read like the heat-map models of the manifest.

use crate::external::onnx::convert::{AttributeValue, OnnxGraph};
use crate::nn::pose::body::BodyNet;
use crate::nn::pose::layers::{ConvLayer, FoldedConv, PictureOperators};
use crate::types::pose2d::N_BODY;
use anyhow::Result;
use candle_core::{Error, Result as TensorResult};

/// Names of input and output.
const IMAGE: &str = "image";
const HEATMAP: &str = "heatmap";
/// The model of the manifest that is fed and read in the same way.
pub const LIKE: &str = "body-tinypose-128x96";

/// Bytes of the file: `image` [1, 3, H, W] to `heatmap` [1, 17, H / 4, W / 4], batch norms folded.
pub fn onnx(net: &BodyNet, n_weights: usize) -> Result<Vec<u8>> {
    let ([height, width], [rows, columns]) = (net.config().size, net.config().cells());
    let mut writer = GraphWriter { graph: OnnxGraph::new(4 * n_weights) };
    let picture = Written { name: IMAGE.to_owned(), size: net.config().size };
    let maps = net.run(&mut writer, &picture)?;
    writer.graph.output(HEATMAP, "Identity", &[&maps.name], &[]);
    Ok(writer.graph.model(&[(IMAGE, &[1, 3, height, width])], &[(HEATMAP, &[1, N_BODY, rows, columns])]))
}

/// The operators as nodes of a graph.
struct GraphWriter {
    graph: OnnxGraph,
}

/// A value of the graph, with its height and width.
struct Written {
    name: String,
    size: [usize; 2],
}

impl PictureOperators for GraphWriter {
    type Value = Written;

    fn convolution(&mut self, layer: &ConvLayer, x: &Written) -> TensorResult<Written> {
        let FoldedConv { shape, weight, bias, has_relu } = layer.folded()?;
        let (kernel, stride) = (shape[2], layer.stride);
        let size = x.size.map(|n| n.div_ceil(stride));
        // The smaller half of the padding goes first.
        let total = [0, 1].map(|axis| ((size[axis] - 1) * stride + kernel).saturating_sub(x.size[axis]) as i64);
        let [top, left] = total.map(|n| n / 2);
        let pads = [top, left, total[0] - top, total[1] - left];
        let weight = self.graph.floats(&shape, &weight).map_err(wrapped)?;
        let bias = self.graph.floats(&shape[..1], &bias).map_err(wrapped)?;
        let attributes = [
            ("kernel_shape", AttributeValue::Ints(&[kernel as i64; 2])),
            ("pads", AttributeValue::Ints(&pads)),
            ("strides", AttributeValue::Ints(&[stride as i64; 2])),
        ];
        let name = self.graph.op("Conv", &[&x.name, &weight, &bias], &attributes);
        Ok(Written { name: if has_relu { self.graph.op("Relu", &[&name], &[]) } else { name }, size })
    }

    fn twice(&mut self, x: &Written) -> TensorResult<Written> {
        let scales = self.graph.floats(&[4], &[1.0, 1.0, 2.0, 2.0]).map_err(wrapped)?;
        let attributes = [
            ("mode", AttributeValue::Text("nearest")),
            ("coordinate_transformation_mode", AttributeValue::Text("asymmetric")),
            ("nearest_mode", AttributeValue::Text("floor")),
        ];
        let name = self.graph.op("Resize", &[&x.name, "", &scales], &attributes);
        Ok(Written { name, size: x.size.map(|n| 2 * n) })
    }

    fn sum(&mut self, a: &Written, b: &Written) -> TensorResult<Written> {
        Ok(Written { name: self.graph.op("Add", &[&a.name, &b.name], &[]), size: a.size })
    }
}

fn wrapped(error: anyhow::Error) -> Error {
    Error::msg(format!("{error:#}"))
}
