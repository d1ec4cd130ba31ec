#![cfg(not(target_arch = "wasm32"))]
//! The golden digests, natively.

mod golden;

#[test]
fn a_seed_gives_the_same_bits_natively() {
    golden::check();
    golden::check_clones();
}
