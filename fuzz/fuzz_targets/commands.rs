#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(init: ape_lab_fuzz::COMMANDS.write_seeds(), |data: &[u8]| ape_lab_fuzz::COMMANDS.run(data));
