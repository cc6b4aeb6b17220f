//! Published files with a known ONNX equivalent.

use crate::fixtures::source_models::run::{SourceModel, assert_close, run};
use orator_onnx::convert::SourceFormat;
use orator_test_support::skip::real_data;
use sha2::{Digest as _, Sha256};

#[test]
fn ncnn_tinypose_is_converted_to_the_model_in_use() {
    let Some(dir) = real_data("models/origin") else { return };
    let files = ["param", "bin"].map(|ending| std::fs::read(dir.join(format!("tinypose_256x192.{ending}"))).unwrap());
    let model = SourceModel::new(SourceFormat::Ncnn, files.to_vec(), &[1, 3, 256, 192], &["heatmap"]);
    let onnx = model.convert().unwrap();
    let hash: String = Sha256::digest(&onnx).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(hash, "f7016a7acb503ff0274ac962bc88f385094714e7aa0aeae9aba7c55436af5b54");
    let byte = |k: u64| (k.wrapping_mul(2_654_435_761) >> 13) & 255;
    let input: Vec<f32> = (0..3 * 256 * 192).map(|k| (byte(k) as f32 / 255.0 - 0.45) / 0.225).collect();
    let Some(found) = run(&onnx, &model.options, &input) else { return };
    let Some(reference) = real_data("models/body_pp_tinypose_256x192.onnx") else { return };
    let Some(expected) = run(&std::fs::read(reference).unwrap(), &model.options, &input) else { return };
    assert_close(&found[0], &[1, 17, 64, 48], &expected[0].1);
}
