//! Converts MoveNet (single pose) to one heat-map per keypoint, attenuated with the distance from the position
//! predicted for the most central person: by 1/2 at a quarter of the image, so that a second person rarely wins.

use super::graph::AttributeValue::{Int, Ints, Text};
use super::graph::{ElementType, OnnxGraph};
use super::layout::CHANNELS_FIRST;
use super::source::ConversionOptions;
use super::tfjs::{TfConverter, TfValue};
use super::tfjs_file::TfGraph;
use anyhow::{Result, bail, ensure};

/// Output nodes of the heads.
const HEATMAP: &str = "StatefulPartitionedCall/kpt_heatmap_0/conv2d_5/BiasAdd";
const CENTRE: &str = "StatefulPartitionedCall/center_0/conv2d_4/BiasAdd";
const REGRESSION: &str = "StatefulPartitionedCall/kpt_regress_0/conv2d_6/BiasAdd";
const OFFSET: &str = "StatefulPartitionedCall/kpt_offset_0/conv2d_7/BiasAdd";
/// Node of the input image before scaling.
const PICTURE: &str = "StatefulPartitionedCall/stack";
/// Constant that weights each cell as the centre of a person.
const CENTRE_WEIGHT: &str = "ConstantFolding/StatefulPartitionedCall/truediv_2_recip";

/// Number of keypoints, and side of a heat-map cell in pixels.
const N_POINTS: usize = 17;
const CELL: usize = 4;

/// Whether the graph contains the nodes of a MoveNet.
pub(crate) fn is_movenet(source: &TfGraph) -> bool {
    [HEATMAP, CENTRE, REGRESSION, OFFSET, PICTURE].iter().all(|node| source.nodes.contains_key(*node))
}

/// Converts the model to ONNX: image [1, S, S, 3], RGB 0..255, to heat-maps [1, 17, S / 4, S / 4] in 0..1.
pub(crate) fn convert(source: &TfGraph, mut graph: OnnxGraph, options: &ConversionOptions) -> Result<Vec<u8>> {
    let (shape, output) = (options.shape()?, options.only_output()?);
    let [1, side, width, 3] = shape[..] else { bail!("expected an input of shape [1, S, S, 3], not {shape:?}") };
    let stated = source.input_shape()?;
    ensure!(side == width && stated == shape, "the model input has shape {stated:?}, expected square {shape:?}");
    let n_side = side / CELL;
    let n_cells = n_side * n_side;

    let image =
        graph.op("Transpose", &[&options.input.name], &[("perm", Ints(&CHANNELS_FIRST.map(|axis| axis as i64)))]);
    // The image is shifted by half a cell, so that a peak at cell i is at 4 i px instead of 4 i + 2.
    let half = (CELL / 2) as i64;
    let pads = graph.ints(&[0, 0, half, half, 0, 0, -half, -half])?;
    let name = graph.op("Pad", &[&image, &pads], &[("mode", Text("constant"))]);
    let mut source =
        TfConverter::new(source, graph, PICTURE, TfValue { name, shape: shape.clone(), channels_first: true });

    let heatmap = head(&mut source, HEATMAP, n_side, N_POINTS)?;
    let heatmap = source.graph.op("Sigmoid", &[&heatmap], &[]);
    let centre = head(&mut source, CENTRE, n_side, 1)?;
    let centre = source.graph.op("Sigmoid", &[&centre], &[]);
    let regression = head(&mut source, REGRESSION, n_side, 2 * N_POINTS)?;
    // Converted only for completeness: the reader refines the heat-maps, and ONNX Runtime removes unused nodes.
    head(&mut source, OFFSET, n_side, 2 * N_POINTS)?;

    let side_cells = source.graph.sizes(&[n_side])?;
    let weight = source.source.tensor(CENTRE_WEIGHT)?;
    let weight = source.weight(weight, None, Some(&[1, 1, n_side, n_side]))?;
    let graph = &mut source.graph;
    // The cell of the most central person, and the expected points relative to it: 17 rows and columns.
    let weighted = graph.op("Mul", &[&centre, &weight], &[]);
    let all_cells = graph.sizes(&[n_cells])?;
    let weighted = graph.op("Reshape", &[&weighted, &all_cells], &[]);
    let best = graph.op("ArgMax", &[&weighted], &[("axis", Int(0)), ("keepdims", Int(1))]);
    let row = graph.op("Div", &[&best, &side_cells], &[]);
    let before = graph.op("Mul", &[&row, &side_cells], &[]);
    let column = graph.op("Sub", &[&best, &before], &[]);
    let points_of_cells = graph.sizes(&[2 * N_POINTS, n_cells])?;
    let regression = graph.op("Reshape", &[&regression, &points_of_cells], &[]);
    let offsets = graph.op("Gather", &[&regression, &best], &[("axis", Int(1))]);
    let pairs = graph.sizes(&[N_POINTS, 2])?;
    let offsets = graph.op("Reshape", &[&offsets, &pairs], &[]);
    let offsets = graph.ops(2, "Split", &[&offsets], &[("axis", Int(1))]);

    // Squared distance of each cell from each expected point.
    let mut squares = Vec::new();
    for (offset, start, axis) in [(&offsets[0], &row, 0), (&offsets[1], &column, 1)] {
        let at = |cell: usize| [cell / n_side, cell % n_side][axis] as f32;
        let cells = graph.floats(&[1, n_cells], &(0..n_cells).map(at).collect::<Vec<_>>())?;
        let start = graph.op("Cast", &[start], &[("to", Int(ElementType::F32 as i64))]);
        let expected = graph.op("Add", &[offset, &start], &[]);
        squares.push(graph.op("Sub", &[&cells, &expected], &[]));
    }
    let squares: Vec<String> =
        squares.iter().map(|difference| graph.op("Mul", &[difference, difference], &[])).collect();
    let square = graph.op("Add", &[&squares[0], &squares[1]], &[]);
    // 1 / (1 + (square / quarter^2)^2)
    let quarter = CELL as f64 / n_side as f64;
    let per_quarter = graph.floats(&[], &[(quarter * quarter) as f32])?;
    let scaled = graph.op("Mul", &[&square, &per_quarter], &[]);
    let scaled = graph.op("Mul", &[&scaled, &scaled], &[]);
    let one = graph.floats(&[], &[1.0])?;
    let sum = graph.op("Add", &[&scaled, &one], &[]);
    let attenuation = graph.op("Reciprocal", &[&sum], &[]);
    let maps = [1, N_POINTS, n_side, n_side];
    let map_shape = graph.sizes(&maps)?;
    let attenuation = graph.op("Reshape", &[&attenuation, &map_shape], &[]);
    graph.output(output, "Mul", &[&heatmap, &attenuation], &[]);
    Ok(source.graph.model(&[(&options.input.name, &shape)], &[(output, &maps)]))
}

/// Output of a head, channels first.
fn head(source: &mut TfConverter, node: &str, n_side: usize, channels: usize) -> Result<String> {
    let value = source.value(node)?;
    ensure!(
        value.channels_first && value.shape == [1, n_side, n_side, channels],
        "node {node:?} has shape {:?}, expected [1, {n_side}, {n_side}, {channels}]",
        value.shape
    );
    Ok(value.name)
}
