//! WAV files: contents and rejected files.

use orator_base::types::sound::Sound;
use orator_formats::wav::{HEADER_BYTES, WavRanges, n_samples, samples, to_bytes, write};

#[test]
fn every_sample_value_round_trips_with_the_plain_header() {
    let all: Vec<f32> = (i16::MIN..=i16::MAX).map(|n| f32::from(n) / 32_768.0).collect();
    let bytes = to_bytes(&Sound { rate: 16_000, samples: all.clone() }).unwrap();
    let header = b"RIFF\x24\0\x02\0WAVEfmt \x10\0\0\0\x01\0\x01\0\x80\x3e\0\0\0\x7d\0\0\x02\0\x10\0data\0\0\x02\0";
    assert_eq!(&bytes[..44], header);
    assert_eq!(n_samples(&bytes[..44], bytes.len() as u64, 16_000).unwrap(), all.len());
    assert_eq!(samples(&bytes[44..]), all);
    let path = tempfile::tempdir().unwrap().keep().join("a.wav");
    write(&path, &Sound { rate: 16_000, samples: all }).unwrap();
    assert_eq!(std::fs::read(path).unwrap(), bytes);
}

#[test]
fn ranges_are_read_after_the_path_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.wav");
    let samples: Vec<f32> = (0..1_000).map(|n| n as f32 / 32_768.0).collect();
    write(&path, &Sound { rate: 16_000, samples: samples.clone() }).unwrap();
    assert!(WavRanges::open(&path, 8_000).is_err());
    let mut ranges = WavRanges::open(&path, 16_000).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(ranges.n_samples(), 1_000);
    for (range, expected) in [(900..950, 900..950), (10..20, 10..20), (990..2_000, 990..1_000), (5_000..6_000, 0..0)] {
        assert_eq!(ranges.read(range).unwrap(), samples[expected]);
    }
}

#[test]
fn samples_are_clipped_and_other_files_rejected() {
    let loud = Sound { rate: 16_000, samples: vec![1.5, -1.5, f32::NAN, 1e-5, 1.6e-5] };
    let bytes = to_bytes(&loud).unwrap();
    let expected = [i16::MAX, i16::MIN, 0, 0, 1].map(i16::to_le_bytes).concat();
    assert_eq!(bytes[44..], expected);
    assert!(n_samples(&bytes[..44], bytes.len() as u64 - 2, 16_000).is_err());
    assert!(n_samples(&bytes[..44], bytes.len() as u64, 22_050).is_err());
    assert!(n_samples(&bytes[..20], 20, 16_000).is_err());
}

proptest::proptest! {
    #[test]
    fn audio_round_trips_within_one_step(
        rate in 1u32..200_000,
        sound in proptest::collection::vec(-1.0f32..1.0, 0..300),
    ) {
        let bytes = to_bytes(&Sound { rate, samples: sound.clone() }).unwrap();
        proptest::prop_assert_eq!(n_samples(&bytes, bytes.len() as u64, rate).unwrap(), sound.len());
        let again = samples(&bytes[HEADER_BYTES..]);
        proptest::prop_assert!(again.iter().zip(&sound).all(|(a, b)| (a - b).abs() <= 1.0 / 32_768.0));
        proptest::prop_assert_eq!(to_bytes(&Sound { rate, samples: again }).unwrap(), bytes);
    }
}
