//! Writer for the fields of protobuf messages.

/// Appends an unsigned number, seven bits per byte, least significant first.
pub(crate) fn varint(out: &mut Vec<u8>, mut number: u64) {
    while number > 127 {
        out.push(number as u8 & 127 | 128);
        number >>= 7;
    }
    out.push(number as u8);
}

pub(crate) fn number(out: &mut Vec<u8>, field: u64, number: i64) {
    varint(out, field << 3);
    varint(out, number as u64);
}

/// Appends a length-delimited field: a string or a message.
pub(crate) fn bytes(out: &mut Vec<u8>, field: u64, bytes: &[u8]) {
    varint(out, field << 3 | 2);
    varint(out, bytes.len() as u64);
    out.extend_from_slice(bytes);
}

/// Appends a 32-bit float field.
pub(crate) fn float(out: &mut Vec<u8>, field: u64, number: f32) {
    varint(out, field << 3 | 5);
    out.extend_from_slice(&number.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_encoded_as_specified() {
        let mut out = Vec::new();
        number(&mut out, 1, 150);
        bytes(&mut out, 2, b"ab");
        float(&mut out, 3, 1.0);
        assert_eq!(out, [8, 150, 1, 18, 2, b'a', b'b', 29, 0, 0, 128, 63]);
        let mut negative = Vec::new();
        number(&mut negative, 1, -1);
        assert_eq!(negative, [8, 255, 255, 255, 255, 255, 255, 255, 255, 255, 1]);
    }
}
