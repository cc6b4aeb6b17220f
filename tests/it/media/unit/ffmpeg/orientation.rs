//! Tests of `orator_media::ffmpeg::orientation`.

use orator_base::types::image::Image;
use orator_media::ffmpeg::orientation::Orientation;

fn two_by_three() -> Image {
    Image { width: 2, height: 3, data: (0..6u8).flat_map(|v| [v; 3]).collect() }
}

fn reds(image: &Image) -> Vec<u8> {
    image.data.iter().step_by(3).copied().collect()
}

#[test]
fn rotates_and_mirrors() {
    // 0 1        4 2 0        5 4        1 3 5        1 0
    // 2 3  cw->  5 3 1   180  3 2   ccw  0 2 4  flip  3 2
    // 4 5                     1 0                     5 4
    let cases = [
        (Orientation { x: [0, 1], y: [-1, 0] }, 90, [3, 2], [4, 2, 0, 5, 3, 1]),
        (Orientation { x: [-1, 0], y: [0, -1] }, 180, [2, 3], [5, 4, 3, 2, 1, 0]),
        (Orientation { x: [0, -1], y: [1, 0] }, 270, [3, 2], [1, 3, 5, 0, 2, 4]),
        (Orientation { x: [-1, 0], y: [0, 1] }, 180, [2, 3], [1, 0, 3, 2, 5, 4]),
        (Orientation::UPRIGHT, 0, [2, 3], [0, 1, 2, 3, 4, 5]),
    ];
    for (orientation, degrees, size, expected) in cases {
        let upright = orientation.apply(two_by_three());
        assert_eq!(orientation.degrees(), degrees);
        assert_eq!([upright.width, upright.height], size);
        assert_eq!(reds(&upright), expected);
        let mirrored = orientation.mirrored().apply(two_by_three());
        let reversed = expected.chunks(size[0]).flat_map(|row| row.iter().rev().copied()).collect::<Vec<_>>();
        assert_eq!(reds(&mirrored), reversed);
    }
}
