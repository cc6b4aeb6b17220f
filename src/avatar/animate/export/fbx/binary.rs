//! Binary FBX container, version 7.4: a tree of named nodes with typed properties, between a fixed header and footer.
//! All numbers are little-endian, arrays are stored uncompressed, and offsets count from the start of the file.

/// Version in the header of the file.
pub const VERSION: i32 = 7400;
/// File id that matches `CREATION_TIME`: readers that check one against the other accept the pair.
pub const FILE_ID: [u8; 16] =
    [0x28, 0xb3, 0x2a, 0xeb, 0xb6, 0x24, 0xcc, 0xc2, 0xbf, 0xc8, 0xb0, 0x2a, 0xa9, 0x2b, 0xfc, 0xf1];
/// Creation time of every file. It is constant so that equal motion gives equal bytes.
pub const CREATION_TIME: &str = "1970-01-01 10:00:00:000";

const HEAD: &[u8; 23] = b"Kaydara FBX Binary  \0\x1a\0";
const FOOT_ID: [u8; 16] =
    [0xfa, 0xbc, 0xab, 0x09, 0xd0, 0xc8, 0xd4, 0x66, 0xb1, 0x76, 0xfb, 0x83, 0x1c, 0xf7, 0x26, 0x7e];
const FOOT_END: [u8; 16] =
    [0xf8, 0x5a, 0x8c, 0x6a, 0xde, 0xf5, 0xd9, 0x7e, 0xec, 0xe9, 0x0c, 0xe3, 0x75, 0x8f, 0x29, 0x0b];
/// An empty node, which ends a list of nodes.
const NULL_NODE: [u8; 13] = [0; 13];

/// Property of a node.
#[derive(Clone, Debug, PartialEq)]
pub enum FbxValue {
    Bool(bool),
    Int(i32),
    Long(i64),
    Double(f64),
    Text(String),
    Raw(Vec<u8>),
    Ints(Vec<i32>),
    Longs(Vec<i64>),
    Floats(Vec<f32>),
    Doubles(Vec<f64>),
}

macro_rules! value_from {
    ($($of:ty => $kind:ident),+) => {
        $(impl From<$of> for FbxValue {
            fn from(value: $of) -> Self {
                Self::$kind(value.into())
            }
        })+
    };
}
value_from!(&str => Text, i32 => Int, i64 => Long, f64 => Double);

/// Node with its properties and children.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FbxNode {
    name: &'static str,
    values: Vec<FbxValue>,
    children: Vec<FbxNode>,
}

impl FbxNode {
    /// Creates a node with these properties.
    pub fn new(name: &'static str, values: Vec<FbxValue>) -> Self {
        Self { name, values, children: Vec::new() }
    }

    /// Creates a node with one property.
    pub fn one(name: &'static str, value: impl Into<FbxValue>) -> Self {
        Self::new(name, vec![value.into()])
    }

    /// Appends children to the node.
    pub fn with(mut self, children: impl IntoIterator<Item = FbxNode>) -> Self {
        self.children.extend(children);
        self
    }

    fn write(&self, bytes: &mut Vec<u8>) {
        let start = bytes.len();
        bytes.extend([0; 4]);
        bytes.extend((self.values.len() as u32).to_le_bytes());
        bytes.extend([0; 4]);
        bytes.push(self.name.len() as u8);
        bytes.extend(self.name.as_bytes());
        let values = bytes.len();
        self.values.iter().for_each(|value| value.write(bytes));
        let length = (bytes.len() - values) as u32;
        bytes[start + 8..start + 12].copy_from_slice(&length.to_le_bytes());
        if !self.children.is_empty() || self.values.is_empty() {
            self.children.iter().for_each(|child| child.write(bytes));
            bytes.extend(NULL_NODE);
        }
        let end = bytes.len() as u32;
        bytes[start..start + 4].copy_from_slice(&end.to_le_bytes());
    }
}

impl FbxValue {
    fn write(&self, bytes: &mut Vec<u8>) {
        fn array<const N: usize>(bytes: &mut Vec<u8>, kind: u8, values: impl ExactSizeIterator<Item = [u8; N]>) {
            bytes.push(kind);
            for word in [values.len(), 0, N * values.len()] {
                bytes.extend((word as u32).to_le_bytes());
            }
            bytes.extend(values.flatten());
        }
        let mut single = |kind: u8, value: &[u8]| {
            bytes.push(kind);
            bytes.extend(value);
        };
        match self {
            Self::Bool(value) => single(b'C', &[u8::from(*value)]),
            Self::Int(value) => single(b'I', &value.to_le_bytes()),
            Self::Long(value) => single(b'L', &value.to_le_bytes()),
            Self::Double(value) => single(b'D', &value.to_le_bytes()),
            Self::Text(text) => {
                single(b'S', &(text.len() as u32).to_le_bytes());
                bytes.extend(text.as_bytes());
            }
            Self::Raw(raw) => {
                single(b'R', &(raw.len() as u32).to_le_bytes());
                bytes.extend(raw);
            }
            Self::Ints(values) => array(bytes, b'i', values.iter().map(|v| v.to_le_bytes())),
            Self::Longs(values) => array(bytes, b'l', values.iter().map(|v| v.to_le_bytes())),
            Self::Floats(values) => array(bytes, b'f', values.iter().map(|v| v.to_le_bytes())),
            Self::Doubles(values) => array(bytes, b'd', values.iter().map(|v| v.to_le_bytes())),
        }
    }
}

/// Bytes of a file with these top-level nodes.
pub fn file(nodes: &[FbxNode]) -> Vec<u8> {
    let mut bytes = HEAD.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    nodes.iter().for_each(|node| node.write(&mut bytes));
    bytes.extend(NULL_NODE);
    bytes.extend(FOOT_ID);
    bytes.extend([0; 4]);
    bytes.resize((bytes.len() + 1).next_multiple_of(16), 0);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend([0; 120]);
    bytes.extend(FOOT_END);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_stores_its_end_properties_and_children() {
        let bytes = file(&[FbxNode::one("A", 7).with([FbxNode::new("Bc", vec![FbxValue::Ints(vec![1, 2])])])]);
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!((&bytes[..18], word(23)), (&b"Kaydara FBX Binary"[..], 7400));
        // Header of A: the offset of its end, one property of five bytes, and a name of one byte.
        assert_eq!((word(27), word(31), word(35), bytes[39], bytes[40]), (95, 1, 5, 1, b'A'));
        assert_eq!((bytes[41], word(42)), (b'I', 7));
        // Bc ends before the empty node that ends the children of A.
        assert_eq!((word(46), word(50), word(54), &bytes[58..61]), (82, 1, 21, &b"\x02Bc"[..]));
        assert_eq!((bytes[61], word(62), word(66), word(70), word(74), word(78)), (b'i', 2, 0, 8, 1, 2));
        assert!(bytes[82..].starts_with(&[0; 26]));
        assert!(bytes.ends_with(&FOOT_END) && (bytes.len() - 140).is_multiple_of(16));
    }
}
