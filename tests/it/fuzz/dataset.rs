//! Readers of a dataset folder, of separate shards, and of the files that accompany them.

use crate::fixtures::fuzzing::harness::{corpus, fixtures, fuzz_file, fuzz_folder};
use orator_base::stage::ledger::Ledger;
use orator_base::stage::progress::Silent;
use orator_dataset::import::shards;
use orator_dataset::split::SplitRecord;
use orator_dataset::verify::verify::verify;
use orator_dataset::write::entry;
use orator_dataset::write::entry::VideoEntry;
use orator_dataset::{Dataset, Split};

#[test]
fn folder() {
    fuzz_folder("folder", &fixtures("dataset"), |dir| {
        if let Ok(dataset) = Dataset::open(dir) {
            for sample in Split::ALL.iter().flat_map(|split| dataset.samples(*split)) {
                let _ = dataset.read(&sample);
            }
        }
        for name in entry::names(dir).unwrap_or_default() {
            if let Ok(entry) = VideoEntry::read(&VideoEntry::path(dir, &name)) {
                let _ = entry.codes(dir);
            }
        }
    });
}

#[test]
fn verification() {
    fuzz_folder("verification", &fixtures("dataset"), |dir| drop(verify(dir, true, &Silent)));
}

#[test]
fn separate_shards() {
    fuzz_file("separate_shards", &corpus("dataset", "train"), "train-000.tar", |path| {
        for video in shards::open(&[path.to_owned()]).videos {
            video.samples.iter().for_each(|sample| drop(sample.read()));
        }
    });
}

#[test]
fn ledgers_and_records() {
    fuzz_file("ledgers_and_records", &corpus("texts", "stage"), "a.json", |path| {
        let _ = (Ledger::read(path), SplitRecord::read(path));
        let _ = orator_formats::media_json::MediaInfo::read(path);
    });
}
