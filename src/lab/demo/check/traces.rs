//! Plot of a trained model: the speed of each wrist over the first 30 s of a test sound by the rule, the speaker and
//! the model; below, a few poses of the latter two.

use anyhow::Result;
use ndarray::{Array3, Axis};
use orator_avatar::animate::draw::figure::{FigureView, INK, LEFT, PAPER, RIGHT, draw_pose, mix};
use orator_base::types::image::Image;
use orator_base::types::time::FrameRate;
use orator_media::opencv::draw;
use orator_test_support::rule::rule::{WRISTS, wrist_speeds};

const WIDTH: usize = 1600;
const LANE_PX: f32 = 220.0;
const POSES_PX: f32 = 170.0;
const MARGIN_PX: f32 = 70.0;
const N_POSES: usize = 10;
/// Duration shown in seconds, and the speed at the top of a lane, m/s.
const SECS: f64 = 30.0;
const TOP_SPEED: f32 = 2.5;
/// Colour of the rule.
const RULE: [u8; 3] = [40, 44, 50];

/// Joints [T, 49, 3] of one clip.
#[derive(Clone, Debug)]
pub struct TraceClip {
    pub rule: Array3<f32>,
    pub data: Array3<f32>,
    pub predicted: Array3<f32>,
}

/// Draws the plot of a clip.
pub fn picture(clip: &TraceClip, fps: FrameRate) -> Result<Image> {
    let mut image = Image::filled(WIDTH, (2.0 * (LANE_PX + POSES_PX)) as usize, PAPER);
    let n_frames = clip.rule.shape()[0].min(fps.frames_in(SECS)).max(2);
    let x_of = |t: f32| MARGIN_PX + (WIDTH as f32 - MARGIN_PX - 10.0) * t / (n_frames - 1) as f32;
    let [rule, data, predicted] =
        [&clip.rule, &clip.data, &clip.predicted].map(|joints| wrist_speeds(joints.view(), fps));
    for (lane, colour) in [LEFT, RIGHT].into_iter().enumerate() {
        let floor = (lane + 1) as f32 * LANE_PX - 20.0;
        let y_of = |speed: f64| floor - (LANE_PX - 40.0) * (speed as f32 / TOP_SPEED).min(1.0);
        draw::line(&mut image, [x_of(0.0), floor], [x_of((n_frames - 1) as f32), floor], 1.0, INK)?;
        for (speeds, rgb, px) in [(&data, mix(INK, PAPER, 0.6), 1.5), (&rule, RULE, 1.5), (&predicted, colour, 2.5)] {
            for t in 1..n_frames - 1 {
                let at = |t: usize| [x_of(t as f32 + 0.5), y_of(speeds[[t, lane]])];
                draw::line(&mut image, at(t - 1), at(t), px, rgb)?;
            }
        }
        let name = if WRISTS[lane] == WRISTS[0] { "left wrist" } else { "right wrist" };
        draw::text(&mut image, name, [4.0, floor - 150.0], 9.0, colour)?;
        draw::text(&mut image, "0..2.5 m/s", [4.0, floor - 130.0], 8.0, INK)?;
    }
    let words = "black: rule   grey: speaker (rule and variation)   coloured: model";
    draw::text(&mut image, words, [MARGIN_PX, 16.0], 9.0, INK)?;
    for (row, (joints, name)) in [(&clip.data, "speaker"), (&clip.predicted, "model")].into_iter().enumerate() {
        let top = 2.0 * LANE_PX + row as f32 * POSES_PX;
        draw::text(&mut image, name, [4.0, top + 80.0], 9.0, INK)?;
        for pose in 0..N_POSES {
            let t = (2 * pose + 1) * (n_frames - 1) / (2 * N_POSES);
            let view = FigureView::front([x_of(t as f32), top + 50.0], 150.0);
            draw_pose(&mut image, joints.index_axis(Axis(0), t), &view)?;
        }
    }
    Ok(image)
}
