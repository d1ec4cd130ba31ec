//! The page; natively the same app in a window.

#[cfg(target_arch = "wasm32")]
fn main() {
    ape_lab::web::page::start();
}

#[cfg(not(target_arch = "wasm32"))]
fn main() -> eframe::Result {
    use ape_lab::lab::{ThreadLink, thread_pool};
    use ape_lab::ui::App;

    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_inner_size([1280.0, 800.0]).with_min_inner_size([360.0, 480.0]),
        ..Default::default()
    };
    eframe::run_native(
        "ape-lab",
        options,
        Box::new(|cc| {
            let waker = || {
                let ctx = cc.egui_ctx.clone();
                move || ctx.request_repaint()
            };
            let link = ThreadLink::new(waker());
            Ok(Box::new(App::new(
                &cc.egui_ctx,
                Box::new(link),
                thread_pool(waker()),
                Box::new(window::Files::default()),
            )))
        }),
    )
}

#[cfg(not(target_arch = "wasm32"))]
mod window {
    //! Files of a window: they are written to where it was started from, and read when they are dropped on it.

    use std::collections::VecDeque;

    use ape_lab::ui::{Host, check_length};

    #[derive(Default)]
    pub struct Files {
        opened: VecDeque<(String, Result<String, String>)>,
    }

    impl Host for Files {
        fn save(&mut self, name: &str, text: &str) -> Result<(), String> {
            ape_lab::files::write(name.as_ref(), text).map_err(|error| format!("{name} could not be written: {error}."))
        }

        fn save_picture(&mut self, _name: &str, _svg: &str) -> Result<(), String> {
            Err("PNG is made by the page in a browser; here the picture is to be had as SVG.".to_owned())
        }

        fn ask_for_file(&mut self) -> Result<(), String> {
            Err("Drop the file on this window.".to_owned())
        }

        fn read(&mut self, file: egui::DroppedFileHandle) {
            let path = file.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let length = std::fs::metadata(path).map(|data| data.len() as f64).map_err(|error| error.to_string());
            let text = length.and_then(check_length).and_then(|()| file.bytes());
            let text = text.and_then(|bytes| String::from_utf8(bytes).map_err(|_| "expected a text".to_owned()));
            self.opened.push_back((name, text));
        }

        fn opened(&mut self) -> Option<(String, Result<String, String>)> {
            self.opened.pop_front()
        }
    }
}
