//! Unit tests of `orator_pipeline::extract::survey`.

use orator_base::types::image::Image;
use orator_pipeline::extract::survey::comb_share;

/// A bright disc on a wall with a thin line, 120 x 80; `x` is the centre on even and on odd lines.
fn disc(x: [f64; 2]) -> Image {
    let mut image = Image::filled(120, 80, [40; 3]);
    for (at, pixel) in image.data.as_chunks_mut::<3>().0.iter_mut().enumerate() {
        let (column, line) = ((at % 120) as f64, at / 120);
        let value = (20.5 - (column - x[line % 2]).hypot(line as f64 - 40.0)).clamp(0.0, 1.0);
        *pixel = [if line == 7 { 200 } else { (40.0 + 180.0 * value) as u8 }; 3];
    }
    image
}

#[test]
fn only_moving_combs_are_measured() {
    assert!(comb_share(&disc([50.0, 62.0]), &disc([74.0, 86.0])) > 0.01);
    let static_disc = disc([50.0; 2]);
    assert_eq!(comb_share(&static_disc, &disc([62.0; 2])), 0.0);
    let mut striped = static_disc;
    striped.data.chunks_exact_mut(3 * 120).step_by(2).for_each(|line| line.fill(90));
    assert_eq!(comb_share(&striped, &striped), 0.0);
    for size in [[0, 0], [1, 1], [3, 4], [1, 9]] {
        let tiny = Image::filled(size[0], size[1], [7; 3]);
        assert_eq!(comb_share(&tiny, &tiny), 0.0);
    }
}
