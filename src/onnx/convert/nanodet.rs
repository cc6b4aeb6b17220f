//! Converts NanoDet to person bounding boxes. Each cell of three grids predicts the distances to the sides of a box,
//! each as a distribution over multiples of the grid's stride, of which the mean is taken (Li et al. 2020, section 3).

use super::graph::AttributeValue::{Int, Ints};
use super::graph::OnnxGraph;
use super::source::ConversionOptions;
use super::tfjs::{TfConverter, TfValue};
use super::tfjs_file::TfGraph;
use anyhow::{Result, bail, ensure};

/// Output nodes of the heads (classes, then distributions) with the strides of their grids in pixels.
const HEADS: [(&str, usize); 3] =
    [("PartitionedCall/Add_29", 8), ("PartitionedCall/Add_33", 16), ("PartitionedCall/Add_37", 32)];
/// Number of COCO classes; the first one is a person.
const N_CLASSES: usize = 80;

/// Whether the graph contains the nodes of a NanoDet.
pub(crate) fn is_nanodet(source: &TfGraph) -> bool {
    HEADS.iter().all(|(node, _)| source.nodes.contains_key(*node))
}

/// Converts to ONNX: image [1, 3, S, S] to rows [1, cells, 5] of x0, y0, x1, y1 in input pixels, and the score, 0..1.
pub(crate) fn convert(source: &TfGraph, graph: OnnxGraph, options: &ConversionOptions) -> Result<Vec<u8>> {
    let (shape, output) = (options.shape()?, options.only_output()?);
    let [1, 3, side, width] = shape[..] else { bail!("expected an input of shape [1, 3, S, S], not {shape:?}") };
    let stated = source.input_shape()?;
    ensure!(side == width && stated == shape, "the model input has shape {stated:?}, expected square {shape:?}");
    let image = TfValue { name: options.input.name.clone(), shape: shape.clone(), channels_first: false };
    let mut source = TfConverter::new(source, graph, source.input()?.0, image);

    let (mut scores, mut distances, mut columns, mut rows) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (node, stride) in HEADS {
        let head = source.value(node)?;
        let [_, _, _, channels] = head.shape[..] else {
            bail!("node {node:?} has shape {:?}, expected 4 axes", head.shape)
        };
        let n_side = side / stride;
        let n_bins = channels.saturating_sub(N_CLASSES) / 4;
        ensure!(
            head.channels_first && n_bins >= 2 && head.shape == [1, n_side, n_side, N_CLASSES + 4 * n_bins],
            "node {node:?} has shape {:?}, expected [1, {n_side}, {n_side}, {N_CLASSES} + 4 bins]",
            head.shape
        );
        let n_cells = n_side * n_side;
        let graph = &mut source.graph;
        let person = slice(graph, &head.name, 1, [0, 1])?;
        let flat = graph.sizes(&[1, 1, n_cells])?;
        scores.push(graph.op("Reshape", &[&person, &flat], &[]));

        let bins = slice(graph, &head.name, 1, [N_CLASSES, channels])?;
        let by_side = graph.sizes(&[1, 4, n_bins, n_cells])?;
        let bins = graph.op("Reshape", &[&bins, &by_side], &[]);
        let distribution = graph.op("Softmax", &[&bins], &[("axis", Int(2))]);
        let lengths: Vec<f32> = (0..n_bins).map(|bin| (bin * stride) as f32).collect();
        let lengths = graph.floats(&[1, 1, n_bins, 1], &lengths)?;
        let distribution = graph.op("Mul", &[&distribution, &lengths], &[]);
        let axis = graph.ints(&[2])?;
        distances.push(graph.op("ReduceSum", &[&distribution, &axis], &[("keepdims", Int(0))]));
        let centre = |cell: usize| (cell as f32 + 0.5) * stride as f32;
        columns.extend((0..n_cells).map(|cell| centre(cell % n_side)));
        rows.extend((0..n_cells).map(|cell| centre(cell / n_side)));
    }
    let n_cells = columns.len();
    let graph = &mut source.graph;
    let scores = graph.concat(&scores, 2);
    let scores = graph.op("Sigmoid", &[&scores], &[]);
    let distances = graph.concat(&distances, 2);
    let centres = graph.floats(&[1, 2, n_cells], &[columns, rows].concat())?;
    let (before, after) = (slice(graph, &distances, 1, [0, 2])?, slice(graph, &distances, 1, [2, 4])?);
    let low = graph.op("Sub", &[&centres, &before], &[]);
    let high = graph.op("Add", &[&centres, &after], &[]);
    let boxes = graph.concat(&[low, high, scores], 1);
    graph.output(output, "Transpose", &[&boxes], &[("perm", Ints(&[0, 2, 1]))]);
    Ok(source.graph.model(&[(&options.input.name, &shape)], &[(output, &[1, n_cells, 5])]))
}

fn slice(graph: &mut OnnxGraph, value: &str, axis: i64, [start, end]: [usize; 2]) -> Result<String> {
    let (start, end, axis) = (graph.sizes(&[start])?, graph.sizes(&[end])?, graph.ints(&[axis])?);
    Ok(graph.op("Slice", &[value, &start, &end, &axis], &[]))
}
