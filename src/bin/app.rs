//! The page; natively the same app in a window.

#[cfg(target_arch = "wasm32")]
fn main() {
    ape_lab::web::page::start();
}

#[cfg(not(target_arch = "wasm32"))]
fn main() -> eframe::Result {
    use ape_lab::{lab::ThreadLink, ui::App};

    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_inner_size([1280.0, 800.0]).with_min_inner_size([360.0, 480.0]),
        ..Default::default()
    };
    eframe::run_native(
        "ape-lab",
        options,
        Box::new(|cc| {
            let wake = cc.egui_ctx.clone();
            let link = ThreadLink::new(move || wake.request_repaint());
            Ok(Box::new(App::new(&cc.egui_ctx, Box::new(link))))
        }),
    )
}
