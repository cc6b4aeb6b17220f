//! Complete networks as one operation of candle each, which does the backward passes of their layers itself: candle's graph
//! would zero and add up a tensor per layer.

use super::frames::{repeat_and_add, repeat_backward};
use super::gradients::accumulate;
use super::layer::{DeviceLayer, LayerRecord, attached};
use candle_core::{Result, Tensor};

/// Applies layers one after the other to `x` [B, C, T] or [B, C, H, W]; see [`DeviceLayer::forward`].
pub fn chain(layers: Vec<DeviceLayer>, x: &Tensor, train: bool, groups: usize) -> Result<Tensor> {
    let Some(parameter) = layers.first().map(|layer| layer.weight.clone()) else { return Ok(x.clone()) };
    let (is_tracked, rank) = (x.track_op(), x.rank());
    let (y, records) = forward(&layers, with_height(&x.detach())?, train, groups)?;
    attached(of_rank(y, rank)?, x, &parameter, move |grad| {
        backward(&layers, &records, with_height(grad)?, is_tracked)?.map(|grad| of_rank(grad, rank)).transpose()
    })
}

/// Applies one layer with channels last, [B, T, C] or [B, T, F, C].
pub fn channels_last(layer: DeviceLayer, x: &Tensor, train: bool) -> Result<Tensor> {
    match x.rank() {
        3 => chain(vec![layer], &x.t()?, train, 1)?.t(),
        _ => chain(vec![layer], &x.permute((0, 3, 1, 2))?, train, 1)?.permute((0, 2, 3, 1)),
    }
}

/// [B, C, T] to [B, C, 1, T].
fn with_height(x: &Tensor) -> Result<Tensor> {
    if x.rank() == 3 { x.unsqueeze(2) } else { Ok(x.clone()) }
}

fn of_rank(x: Tensor, rank: usize) -> Result<Tensor> {
    if rank == 3 { x.squeeze(2) } else { Ok(x) }
}

fn forward(layers: &[DeviceLayer], mut x: Tensor, train: bool, groups: usize) -> Result<(Tensor, Vec<LayerRecord>)> {
    let mut records = Vec::new();
    for layer in layers {
        let (y, record) = layer.forward(&x, train, groups)?;
        records.push(record);
        x = y;
    }
    Ok((x, records))
}

/// Gradient of the input of layers, if `needs_input`.
fn backward(
    layers: &[DeviceLayer],
    records: &[LayerRecord],
    mut grad: Tensor,
    needs_input: bool,
) -> Result<Option<Tensor>> {
    for (i, (layer, record)) in layers.iter().zip(records).enumerate().rev() {
        match layer.backward(record, &grad, needs_input || i > 0)? {
            Some(of_input) => grad = of_input,
            None => return Ok(None),
        }
    }
    Ok(Some(grad))
}

/// Layers of a UNet over time.
pub struct UnetLayers {
    pub enter: Vec<DeviceLayer>,
    /// Layers that halve the frame rate, and as many that follow an upsampling.
    pub downs: Vec<DeviceLayer>,
    pub ups: Vec<DeviceLayer>,
    pub decoder: Vec<DeviceLayer>,
    /// Number of frames, 0 or 1, by which repeated frames are delayed; see `ops::resize::repeat_frames_and_add`.
    pub delay: usize,
}

/// Applies a UNet to `x` [B, C, T]: each result of `enter` and `downs` but the last is added to the repeated frames of the
/// same rate before the layer of `ups`.
pub fn unet(layers: UnetLayers, x: &Tensor, train: bool) -> Result<Tensor> {
    let UnetLayers { enter, downs, ups, decoder, delay } = layers;
    let none = || candle_core::Error::Msg("a UNet needs layers in all of its parts".to_owned());
    let (parameter, is_tracked) = (decoder.first().ok_or_else(none)?.weight.clone(), x.track_op());
    let (mut y, enter_records) = forward(&enter, with_height(&x.detach())?, train, 1)?;
    let (mut skips, mut down_records, mut up_records) = (Vec::new(), Vec::new(), Vec::new());
    for layer in &downs {
        let (down, record) = layer.forward(&y, train, 1)?;
        skips.push(std::mem::replace(&mut y, down));
        down_records.push(record);
    }
    for (layer, skip) in ups.iter().zip(skips.iter().rev()) {
        let (up, record) = layer.forward(&repeat_and_add(&y, skip, delay)?, train, 1)?;
        y = up;
        up_records.push(record);
    }
    drop(skips);
    let (y, decoder_records) = forward(&decoder, y, train, 1)?;
    attached(of_rank(y, 3)?, x, &parameter, move |grad| {
        let mut grad = backward(&decoder, &decoder_records, with_height(grad)?, true)?.ok_or_else(none)?;
        let mut of_skips = Vec::new();
        for (layer, record) in ups.iter().zip(&up_records).rev() {
            let of_sum = layer.backward(record, &grad, true)?.ok_or_else(none)?;
            grad = repeat_backward(&of_sum, delay)?;
            of_skips.push(of_sum);
        }
        // The last layer of `ups` has the first skip connection.
        for ((layer, record), of_skip) in downs.iter().zip(&down_records).zip(of_skips).rev() {
            grad = layer.backward(record, &grad, true)?.ok_or_else(none)?;
            accumulate(&grad, &of_skip)?;
        }
        backward(&enter, &enter_records, grad, is_tracked)?.map(|grad| of_rank(grad, 3)).transpose()
    })
}
