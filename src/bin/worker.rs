//! The browser's worker: a training session behind messages.

fn main() {
    #[cfg(target_arch = "wasm32")]
    ape_lab::web::worker::run();
    #[cfg(not(target_arch = "wasm32"))]
    eprintln!("worker: runs in a browser only; `cargo run --bin app` opens a window");
}
