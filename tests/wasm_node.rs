#![cfg(target_arch = "wasm32")]
//! The core as WebAssembly under node.

mod golden;

use ape_lab::ape::Figures;
use ape_lab::experiment::Preset;
use ape_lab::mdp::HORIZON;
use wasm_bindgen_test::wasm_bindgen_test;

#[wasm_bindgen_test]
fn a_seed_gives_the_same_bits_under_node() {
    golden::check();
    golden::check_presets();
    golden::check_clones();
}

#[wasm_bindgen_test]
fn exact_figures_are_the_same_under_node() {
    let (grid, ensemble) = (Preset::find("trap").unwrap().setup)().ensemble.unwrap().check().unwrap();
    let figures = Figures::of(&grid, &ensemble, HORIZON);
    assert!((figures.clone_occupancy.capped_return + 90.45).abs() < 0.005);
    assert!((figures.optimal.capped_return + 9.0).abs() < 1e-6);
}
