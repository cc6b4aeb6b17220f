//! libavfilter filters, run on the calling thread only: deinterlacing with `yadif` (it leaves no combing in an
//! animated clip, `bwdif` leaves 5 %), and tone mapping of HDR (ITU-R BT.2100) to SDR with `zscale` and `tonemap`,
//! where 1 is the reference white of BT.2408.

use anyhow::{Context, Result, ensure};
use ffmpeg_next::format::Pixel;
use ffmpeg_next::{Error, color, ffi, filter, frame};

/// Luminance of the reference white, cd/m2.
const WHITE: f64 = 203.0;
/// Fraction of the reference white up to which luminance is unchanged; brighter light is compressed towards 1.
const KNEE: f64 = 0.8;
/// Minimum side of an image for which all planes are large enough for `yadif`.
const MIN_SIDE_PX: u32 = 16;

/// A filter chain between a frame source and a sink.
struct FilterGraph(filter::Graph);

impl FilterGraph {
    fn new(format: Pixel, [width, height]: [u32; 2], chain: &str) -> Result<Self> {
        let open = || -> Result<filter::Graph, Error> {
            let mut graph = filter::Graph::new();
            // SAFETY: the graph is owned here and has no filter yet.
            unsafe { (*graph.as_mut_ptr()).nb_threads = 1 };
            let [source, sink] = ["buffer", "buffersink"].map(|name| filter::find(name).ok_or(Error::FilterNotFound));
            let number = ffi::AVPixelFormat::from(format) as i32;
            let frames = format!("video_size={width}x{height}:pix_fmt={number}:time_base=1/25");
            graph.add(&source?, "in", &frames)?;
            graph.add(&sink?, "out", "")?;
            graph.output("in", 0)?.input("out", 0)?.parse(chain)?;
            graph.validate()?;
            Ok(graph)
        };
        Ok(Self(open().with_context(|| format!("libavfilter cannot run `{chain}` on {format:?} images"))?))
    }

    /// Passes a frame to the chain; `None` marks the end.
    fn push(&mut self, frame: Option<&frame::Video>) -> Result<()> {
        let mut source = self.0.get("in").context("the filter graph has no source")?;
        // SAFETY: the source belongs to the live graph and takes its own reference to a live frame; null marks the end.
        let code = unsafe {
            let frame = frame.map_or(std::ptr::null(), |frame| frame.as_ptr());
            ffi::av_buffersrc_write_frame(source.as_mut_ptr(), frame)
        };
        ensure!(code >= 0, "libavfilter rejected a frame ({})", Error::from(code));
        Ok(())
    }

    /// Next output frame of the chain.
    fn pull(&mut self) -> Result<frame::Video> {
        let mut frame = frame::Video::empty();
        let mut sink = self.0.get("out").context("the filter graph has no sink")?;
        sink.sink().frame(&mut frame).context("libavfilter returned no frame")?;
        Ok(frame)
    }
}

/// Deinterlaces a frame: the image of its first field, interpolated with its neighbours in the video.
pub(crate) fn deinterlaced(
    before: Option<&frame::Video>,
    frame: &frame::Video,
    after: Option<&frame::Video>,
) -> Result<frame::Video> {
    let format_and_size = |frame: &frame::Video| (frame.format(), [frame.width(), frame.height()]);
    let (format, size) = format_and_size(frame);
    if size[0].min(size[1]) < MIN_SIDE_PX {
        return Ok(frame.clone());
    }
    let [before, after] =
        [before, after].map(|neighbour| neighbour.filter(|neighbour| format_and_size(neighbour) == (format, size)));
    let mut graph = FilterGraph::new(format, size, "yadif=mode=send_frame:parity=auto:deint=all")?;
    for frame in [before, Some(frame), after].into_iter().flatten() {
        graph.push(Some(frame))?;
    }
    graph.push(None)?;
    if before.is_some() {
        graph.pull()?;
    }
    graph.pull()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HdrTransfer {
    Pq,
    Hlg,
}

impl HdrTransfer {
    /// Transfer function of `frame`; `None` for SDR.
    pub(crate) fn of(frame: &frame::Video) -> Option<Self> {
        match frame.color_transfer_characteristic() {
            color::TransferCharacteristic::SMPTE2084 => Some(Self::Pq),
            color::TransferCharacteristic::ARIB_STD_B67 => Some(Self::Hlg),
            _ => None,
        }
    }

    /// Short name: `PQ` or `HLG`.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Pq => "PQ",
            Self::Hlg => "HLG",
        }
    }
}

/// Tone mapper for HDR images of one size.
pub(crate) struct ToneMapper(FilterGraph);

impl ToneMapper {
    /// Pixel format that `map` expects.
    pub(crate) const FORMAT: Pixel = Pixel::GBRP16LE;

    /// Creates a tone mapper; `has_wide_gamut`: the primaries are those of BT.2020, not BT.709.
    pub(crate) fn new(transfer: HdrTransfer, has_wide_gamut: bool, size: [u32; 2]) -> Result<Self> {
        let (transfer, peak) = match transfer {
            HdrTransfer::Pq => ("smpte2084", 10_000.0 / WHITE),
            HdrTransfer::Hlg => ("arib-std-b67", 1000.0 / WHITE),
        };
        let primaries = if has_wide_gamut { "2020" } else { "709" };
        let chain = format!(
            "zscale=min=gbr:rin=full:tin={transfer}:pin={primaries}:m=gbr:r=full:t=linear:p=709:npl={WHITE},\
             format=gbrpf32le,tonemap=mobius:param={KNEE}:desat=0:peak={peak},\
             zscale=min=gbr:rin=full:tin=linear:pin=709:m=gbr:r=full:t=709:p=709,format=gbrp,format=rgb24"
        );
        Ok(Self(FilterGraph::new(Self::FORMAT, size, &chain)?))
    }

    /// Maps an image to 8-bit RGB.
    pub(crate) fn map(&mut self, frame: &frame::Video) -> Result<frame::Video> {
        self.0.push(Some(frame))?;
        self.0.pull()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tone-mapped image of one colour.
    fn mapped(transfer: HdrTransfer, has_wide_gamut: bool, [r, g, b]: [f64; 3]) -> [u8; 3] {
        let mut frame = frame::Video::new(ToneMapper::FORMAT, 16, 16);
        for (plane, value) in [g, b, r].into_iter().enumerate() {
            let value = ((value * 65535.0).round() as u16).to_le_bytes();
            frame.data_mut(plane).as_chunks_mut::<2>().0.fill(value);
        }
        let rgb = ToneMapper::new(transfer, has_wide_gamut, [16, 16]).unwrap().map(&frame).unwrap();
        [rgb.data(0)[0], rgb.data(0)[1], rgb.data(0)[2]]
    }

    fn gray(transfer: HdrTransfer, signal: f64) -> u8 {
        let out = mapped(transfer, true, [signal; 3]);
        assert!(out[0].abs_diff(out[1]) <= 1 && out[1].abs_diff(out[2]) <= 1, "{out:?}");
        out[1]
    }

    #[test]
    fn reference_levels_match_bt_2408() {
        // BT.2408, table 1: the reference white is at 58 % PQ and 75 % HLG, an 18 % grey card at 38 % of both.
        for (transfer, white) in [(HdrTransfer::Pq, 0.58), (HdrTransfer::Hlg, 0.75)] {
            assert!((240..=248).contains(&gray(transfer, white)), "{}", gray(transfer, white));
            let card = 255.0 * (26.0f64 / 203.0).powf(1.0 / 2.4);
            let found = f64::from(gray(transfer, 0.38));
            assert!((found - card).abs() < 4.0, "{transfer:?}: {found}, expected {card}");
            assert_eq!(gray(transfer, 0.0), 0);
            assert!(gray(transfer, 1.0) >= 252);
            let levels: Vec<u8> = (0..=50).map(|step| gray(transfer, f64::from(step) / 50.0)).collect();
            assert!(levels.is_sorted(), "{levels:?}");
        }
    }

    #[test]
    fn tone_mapping_preserves_hue() {
        // PQ signals of 4, 2 and 1 times the reference white.
        let light = mapped(HdrTransfer::Pq, false, [0.7244, 0.6509, 0.5807]).map(|v| (f64::from(v) / 255.0).powf(2.4));
        assert!((light[0] / light[1] - 2.0).abs() < 0.1 && (light[1] / light[2] - 2.0).abs() < 0.1, "{light:?}");
    }

    #[test]
    fn frames_of_any_size_are_deinterlaced_without_neighbours_or_beside_others() {
        let blank = |size: [u32; 2]| {
            let mut frame = frame::Video::new(Pixel::YUV420P, size[0], size[1]);
            (0..3).for_each(|plane| frame.data_mut(plane).fill(128));
            frame
        };
        let found = deinterlaced(Some(&blank([64, 48])), &blank([128, 80]), None).unwrap();
        assert_eq!((found.width(), found.data(0)[0]), (128, 128));
        for size in [[1, 1], [16, 15], [9, 40], [16, 16]] {
            assert_eq!(deinterlaced(None, &blank(size), None).unwrap().height(), size[1]);
        }
    }
}
