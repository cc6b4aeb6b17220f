//! The training log as a TensorBoard event file: one record per log line. Records use TensorFlow's TFRecord framing
//! (length, masked CRC-32C, bytes, masked CRC-32C); each holds an `Event` (tensorflow's event.proto) with a `Summary`
//! of `simple_value`s. The wall time of an event is its step, so that the bytes are deterministic.

use serde_json::{Map, Value};

/// File name, in the folder of `metrics.jsonl`; TensorBoard looks for `tfevents` in the name.
pub const FILE: &str = "events.out.tfevents.orator";
/// File version, which TensorBoard expects in the first record.
const VERSION: &[u8] = b"brain.Event:2";
const MASK: u32 = 0xa282_ead8;

/// First record of a file.
pub fn first() -> Vec<u8> {
    let mut event = Vec::new();
    field(&mut event, 3, VERSION);
    framed(&event)
}

/// Record of a log line; `None` if the line has no number. `l1` of a training line becomes `train/l1`; in a
/// validation, `pck` of the generator becomes `validation/pck`, of another predictor `validation/mean_pose/pck`.
pub fn record(line: &Value) -> Option<Vec<u8>> {
    let step = line["step"].as_u64()?;
    let mut scalars = Vec::new();
    match line["validation"].as_object() {
        Some(validation) => collect("validation", validation, &mut scalars),
        None => collect("train", line.as_object()?, &mut scalars),
    }
    let mut summary = Vec::new();
    for (tag, value) in scalars {
        let mut scalar = Vec::new();
        field(&mut scalar, 1, tag.as_bytes());
        scalar.push(2 << 3 | 5); // simple_value, 4 bytes
        scalar.extend((value as f32).to_le_bytes());
        field(&mut summary, 1, &scalar);
    }
    if summary.is_empty() {
        return None;
    }
    let mut event = vec![1 << 3 | 1]; // wall_time, 8 bytes
    event.extend((step as f64).to_le_bytes());
    event.push(2 << 3); // step, varint
    varint(&mut event, step);
    field(&mut event, 5, &summary);
    Some(framed(&event))
}

/// Collects all numbers below `object`, with their paths prefixed by `under`.
pub fn collect(under: &str, object: &Map<String, Value>, scalars: &mut Vec<(String, f64)>) {
    for (name, value) in object {
        match value {
            Value::Object(inner) if name == "generator" => collect(under, inner, scalars),
            Value::Object(inner) => collect(&format!("{under}/{name}"), inner, scalars),
            Value::Number(number) if name != "step" => {
                scalars.extend(number.as_f64().map(|number| (format!("{under}/{name}"), number)));
            }
            _ => {}
        }
    }
}

/// Appends a length-delimited protobuf field.
fn field(message: &mut Vec<u8>, number: u8, bytes: &[u8]) {
    message.push(number << 3 | 2);
    varint(message, bytes.len() as u64);
    message.extend(bytes);
}

fn varint(message: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        message.push(value as u8 | 0x80);
        value >>= 7;
    }
    message.push(value as u8);
}

fn framed(event: &[u8]) -> Vec<u8> {
    let length = (event.len() as u64).to_le_bytes();
    [&length[..], &masked_crc(&length).to_le_bytes(), event, &masked_crc(event).to_le_bytes()].concat()
}

fn masked_crc(bytes: &[u8]) -> u32 {
    crc32c::crc32c(bytes).rotate_right(15).wrapping_add(MASK)
}
