//! The benchmark: its command line, small measurements, and errors for invalid arguments.

use crate::bench::child::{high_water_mib, n_running, ticks};
use crate::bench::command::{Cli, measure};
use clap::CommandFactory;
use orator_base::stage::progress::Silent;
use serde_json::Value;

fn facts(args: &str) -> Value {
    measure(args.split_whitespace(), &Silent).unwrap().facts
}

fn fails(args: &str, expected: &str) {
    let error = measure(args.split_whitespace(), &Silent).err().unwrap();
    assert!(format!("{error:#}").contains(expected), "{args}: {error:#}");
}

#[test]
fn the_command_line_is_valid() {
    Cli::command().debug_assert();
    fails("", "no part");
    fails("nothing", "unrecognized");
}

#[test]
fn proc_files_are_parsed() {
    assert_eq!(high_water_mib("VmPeak:\t9 kB\nVmHWM:\t  2048 kB\n"), Some(2.0));
    let stat = "7 (a (b) c) R 1 7 7 0 -1 4194304 100 0 0 0 12 30 0 0 20 0 1 0 5 6 7";
    assert_eq!(ticks(stat), Some(42.0));
    assert!(n_running("/proc/self") >= 1);
}

#[test]
fn the_lifter_is_measured_without_python_and_python_errors_are_named() {
    let small = "lifter --channels 4 --steps 2 --rounds 1";
    let facts = facts(&format!("{small} --widths 3,3 --batch 4"));
    assert!(facts["secs_a_step"].as_f64().unwrap() > 0.0 && facts["window"] == 9, "{facts}");
    fails(&format!("{small} --widths 3,3 --batch 4 --python gone.py"), "gone.py did not start");
    fails(&format!("{small} --widths 2,3 --batch 4"), "odd");
    fails(&format!("{small} --widths 101,101 --batch 4"), "more than 10000 frames");
    fails(&format!("{small} --widths 3,3 --batch 1"), "two windows");
}

#[test]
fn generation_is_measured() {
    let facts = facts("generate --secs 2 --preset light");
    let light = &facts["light"];
    assert!(light["times_real_time"].as_f64().unwrap() > 0.0 && light["peak_mib"].as_f64().unwrap() > 1.0, "{facts}");
    fails("generate --secs 0", "--secs");
    fails("generate --rounds 0", "nothing to measure");
    fails("generate --secs 2 --chunk 33", "32");
}

#[test]
fn a_training_step_is_measured() {
    let facts = facts("train --batch 2 --steps 1 --rounds 1");
    assert!(facts["secs_a_step"].as_f64().unwrap() > 0.0, "{facts}");
    assert_eq!(facts["parts"].as_object().unwrap().len(), 5, "{facts}");
    fails("train --batch 1", "two windows");
    fails("train --preset large", "`light`, `paper`");
}

#[test]
fn the_renderer_is_measured() {
    let facts = facts("render --frames 2 --rounds 1");
    assert!(facts["draw_ms"].as_f64().unwrap() > 0.0 && facts["encode_ms"].as_f64().unwrap() > 0.0, "{facts}");
    assert!(facts["triangles"].as_u64().unwrap() > 10_000, "{facts}");
    fails("render --rounds 0", "nothing to measure");
}

#[test]
fn claims_are_measured() {
    let facts = facts("claims --units 300 --workers 3");
    // A claim and an end per unit, and those of workers that came second.
    let created = facts["created"].as_f64().unwrap();
    assert!((2.0..4.0).contains(&created), "{facts}");
    fails("claims --units 0", "more than 0");
}
