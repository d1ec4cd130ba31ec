#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(init: ape_lab_fuzz::ENSEMBLE.write_seeds(), |data: &[u8]| ape_lab_fuzz::ENSEMBLE.run(data));
