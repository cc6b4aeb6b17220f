//! The parts of an FBX file around its objects: header, global settings (cm, y up, facing +z, frame rate), object
//! counts by kind, and connections.

use super::binary::{CREATION_TIME, FILE_ID, FbxNode, FbxValue, VERSION};
use orator_base::types::time::FrameRate;

/// Time units per second.
const TICKS: i128 = 46_186_158_000;
const CREATOR: &str = concat!("orator ", env!("CARGO_PKG_VERSION"));
/// Frame rates with a `TimeMode` of their own; other rates are given as a number of frames per second.
const RATES: [(u32, i32); 8] = [(120, 1), (100, 2), (60, 3), (50, 4), (48, 5), (30, 6), (25, 10), (24, 11)];
const CUSTOM_RATE: i32 = 14;
const DOCUMENT: i64 = 1;

/// Objects of a file and their connections.
#[derive(Debug)]
pub struct FbxObjects {
    objects: Vec<FbxNode>,
    connections: Vec<FbxNode>,
    /// Number of objects of each kind.
    counts: Vec<(&'static str, i32)>,
    next: i64,
}

impl FbxObjects {
    pub fn new() -> Self {
        Self { objects: Vec::new(), connections: Vec::new(), counts: Vec::new(), next: DOCUMENT + 1 }
    }

    /// Adds an object with a kind (the name of its node), name, class and sub-class; returns its id.
    pub fn add(
        &mut self,
        kind: &'static str,
        (name, class, sub): (&str, &str, &str),
        content: impl IntoIterator<Item = FbxNode>,
    ) -> i64 {
        let number = self.next;
        self.next += 1;
        let title = format!("{name}\0\u{1}{class}");
        let values = vec![number.into(), FbxValue::Text(title), sub.into()];
        self.objects.push(FbxNode::new(kind, values).with(content));
        match self.counts.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, count)) => *count += 1,
            None => self.counts.push((kind, 1)),
        }
        number
    }

    /// Connects an object as a child of another (0 is the scene).
    pub fn connect(&mut self, child: i64, parent: i64) {
        self.connections.push(FbxNode::new("C", vec!["OO".into(), child.into(), parent.into()]));
    }

    pub fn connect_property(&mut self, child: i64, parent: i64, property: &str) {
        let values = vec!["OP".into(), child.into(), parent.into(), property.into()];
        self.connections.push(FbxNode::new("C", values));
    }

    /// Top-level nodes of a file with these objects, a frame rate, `n_frames` frames and an animation called `take`.
    pub fn document(self, fps: FrameRate, n_frames: usize, take: &str) -> Vec<FbxNode> {
        let rate =
            RATES.into_iter().find(|&(rate, _)| FrameRate::new(rate, 1) == fps).map_or(CUSTOM_RATE, |found| found.1);
        let integer = |name: &str, value: i32| property(name, ["int", "Integer", ""], vec![value.into()]);
        let number = |name: &str, value: f64| property(name, ["double", "Number", ""], vec![value.into()]);
        let time = |name: &str, frame: usize| property(name, ["KTime", "Time", ""], vec![ticks(fps, frame).into()]);
        let settings = [
            integer("UpAxis", 1),
            integer("UpAxisSign", 1),
            integer("FrontAxis", 2),
            integer("FrontAxisSign", 1),
            integer("CoordAxis", 0),
            integer("CoordAxisSign", 1),
            integer("OriginalUpAxis", 1),
            integer("OriginalUpAxisSign", 1),
            number("UnitScaleFactor", 1.0),
            number("OriginalUnitScaleFactor", 1.0),
            property("TimeMode", ["enum", "", ""], vec![rate.into()]),
            time("TimeSpanStart", 0),
            time("TimeSpanStop", n_frames.saturating_sub(1)),
            number("CustomFrameRate", if rate == CUSTOM_RATE { fps.per_sec() } else { -1.0 }),
        ];
        let stamp = [("Version", 1000), ("Year", 1970), ("Month", 1), ("Day", 1), ("Hour", 10), ("Minute", 0)];
        let stamp = stamp.into_iter().chain([("Second", 0), ("Millisecond", 0)]);
        let header = FbxNode::new("FBXHeaderExtension", vec![]).with([
            FbxNode::one("FBXHeaderVersion", 1003),
            FbxNode::one("FBXVersion", VERSION),
            FbxNode::one("EncryptionType", 0),
            FbxNode::new("CreationTimeStamp", vec![]).with(stamp.map(|(name, value)| FbxNode::one(name, value))),
            FbxNode::one("Creator", CREATOR),
        ]);
        let stack = property("ActiveAnimStackName", ["KString", "", ""], vec![take.into()]);
        let document = FbxNode::new("Document", vec![DOCUMENT.into(), "".into(), "Scene".into()])
            .with([properties([stack]), FbxNode::one("RootNode", 0_i64)]);
        let counts = self.counts.iter().copied().chain([("GlobalSettings", 1)]);
        let kinds = counts.clone().map(|(kind, n)| FbxNode::one("ObjectType", kind).with([FbxNode::one("Count", n)]));
        let total: i32 = counts.clone().map(|(_, n)| n).sum();
        vec![
            header,
            FbxNode::one("FileId", FbxValue::Raw(FILE_ID.to_vec())),
            FbxNode::one("CreationTime", CREATION_TIME),
            FbxNode::one("Creator", CREATOR),
            FbxNode::new("GlobalSettings", vec![]).with([FbxNode::one("Version", 1000), properties(settings)]),
            FbxNode::new("Documents", vec![]).with([FbxNode::one("Count", 1), document]),
            FbxNode::new("References", vec![]),
            FbxNode::new("Definitions", vec![])
                .with([FbxNode::one("Version", 100), FbxNode::one("Count", total)])
                .with(kinds),
            FbxNode::new("Objects", vec![]).with(self.objects),
            FbxNode::new("Connections", vec![]).with(self.connections),
            FbxNode::new("Takes", vec![]).with([FbxNode::one("Current", take)]),
        ]
    }
}

/// Time of a frame in FBX time units.
pub fn ticks(fps: FrameRate, frame: usize) -> i64 {
    let (num, den) = (i128::from(fps.num.max(1)), i128::from(fps.den));
    ((frame as i128 * den * TICKS + num / 2) / num) as i64
}

pub fn properties(list: impl IntoIterator<Item = FbxNode>) -> FbxNode {
    FbxNode::new("Properties70", vec![]).with(list)
}

/// A property with its type, label and flags.
pub fn property(name: &str, [kind, label, flags]: [&str; 3], values: Vec<FbxValue>) -> FbxNode {
    let head = vec![name.into(), kind.into(), label.into(), flags.into()];
    FbxNode::new("P", head.into_iter().chain(values).collect())
}
