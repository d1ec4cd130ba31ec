#![cfg(not(target_arch = "wasm32"))]
//! The golden digests, natively.

mod golden;

#[test]
fn a_seed_gives_the_same_bits_natively() {
    golden::check();
    golden::check_presets();
    golden::check_clones();
}

/// Eight runs beside one another, on however many cores there are, do not disturb each other.
#[test]
fn a_seed_gives_the_same_bits_on_many_threads() {
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(golden::check_presets);
        }
    });
}
