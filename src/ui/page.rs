//! Where the parts of the page stand.

use egui::{CentralPanel, Frame, Margin, RichText, ScrollArea, Ui};

use super::address::NO_CLIPBOARD;
use super::app::{App, Session, TABS, Tab, View};
use super::board::Shown;
use super::compare::{self, Kept};
use super::heatmap::Pictures;
use super::panels::Touched;
use super::theme::{self, GAP, NARROW, Palette, SPACE, WIDE};
use super::widgets::choose_wrapped;
use super::{commands, controls, focus, headline, heatmap, help, lesson, policy_table, toolbar};
use crate::lab::Command;

/// Width of the controls and of the lesson, where they stand beside the board.
const CONTROLS: f32 = 272.0;
const LESSON: f32 = 372.0;

/// A way to draw the run that is shown; it says what the visitor did to it.
type DrawBoard = fn(&Shown, &mut Ui, &View, &[Kept], &mut Pictures) -> Touched;

impl eframe::App for App {
    fn logic(&mut self, _ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.hear();
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
    }

    /// The ground of the page: what is cleared with it need not be painted over.
    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }
}

impl App {
    /// Draws the page, and says what has been drawn.
    pub fn show(&mut self, ui: &mut Ui) {
        let before = (self.is_retraining(), self.shows_controls());
        self.draw(ui);
        let focus = ui.ctx().memory(|memory| memory.focused());
        // This frame is drawn once more:
        if before != (self.is_retraining(), self.shows_controls()) {
            // what stands above what was moved is of before;
            ui.ctx().request_discard("the controls have moved");
        } else if focus.is_some() && focus != self.focus {
            // egui gives the arrow keys to who has had the focus before, and the next key may come before the next frame.
            ui.ctx().request_discard("the focus has moved");
        }
        self.focus = focus;
        if let Some(number) = self.undrawn.take() {
            self.send(Command::Seen(number));
        }
    }

    fn draw(&mut self, ui: &mut Ui) {
        self.tick(ui.ctx());
        for file in ui.input(|input| input.raw.dropped_files.clone()) {
            self.host.read(file);
        }
        let width = ui.available_width();
        if width < NARROW {
            theme::enlarge_targets(ui);
        }
        let margin = if width < NARROW { 10 } else { SPACE as i8 };
        let sheet = Frame::new().inner_margin(Margin::symmetric(margin, 10));
        if width < WIDE {
            // Where its contents scroll they fade into the colour that they stand on.
            CentralPanel::no_frame().frame(sheet.fill(Palette::of(ui).ground)).show(ui, |ui| {
                ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                    self.show_bar(ui);
                    self.show_tabs(ui);
                    if self.view.tab == Tab::Learn {
                        theme::card(ui).show(ui, |ui| {
                            ui.set_width(ui.available_width());
                            lesson::show(ui, self);
                        });
                        ui.add_space(GAP);
                    }
                    // What a tab is about comes first; the board is about what the headline says.
                    let has_board = matches!(self.view.tab, Tab::Train | Tab::Learn);
                    if has_board {
                        self.show_headline(ui);
                    }
                    self.show_tab(ui, Shown::show_stacked);
                    if !has_board {
                        ui.add_space(GAP);
                        self.show_headline(ui);
                    }
                    ui.add_space(GAP);
                    theme::card(ui).show(ui, |ui| {
                        ui.set_width(ui.available_width());
                        controls::show(ui, self);
                    });
                });
            });
        } else {
            egui::Panel::top("top").frame(sheet).show_separator_line(false).show(ui, |ui| {
                self.show_bar(ui);
                self.show_headline(ui);
            });
            let is_lesson = self.view.tab == Tab::Learn;
            egui::Panel::left(if is_lesson { "lesson" } else { "controls" })
                .exact_size(if is_lesson { LESSON } else { CONTROLS })
                .resizable(false)
                .show_separator_line(false)
                .frame(Frame::new().inner_margin(Margin { left: margin, right: 4, top: 0, bottom: 10 }))
                .show(ui, |ui| {
                    theme::card(ui).show(ui, |ui| {
                        ScrollArea::vertical()
                            .auto_shrink([false, false])
                            .show(ui, |ui| if is_lesson { lesson::show(ui, self) } else { controls::show(ui, self) });
                    });
                });
            let rest = Frame::new().inner_margin(Margin { left: 12, right: margin, top: 0, bottom: 10 });
            CentralPanel::no_frame().frame(rest).show(ui, |ui| {
                self.show_tabs(ui);
                self.show_tab(ui, Shown::show_planned);
            });
        }
        self.show_windows(ui);
        focus::show(ui, &mut self.view.is_by_keyboard);
        commands::listen(ui.ctx(), self);
        self.update_address(ui.ctx());
    }

    fn show_bar(&mut self, ui: &mut Ui) {
        ui.scope(|ui| toolbar::show(ui, self));
        ui.add_space(2.0);
        self.show_messages(ui);
        if self.is_new {
            self.welcome(ui);
        }
    }

    /// What a visitor is told who comes for the first time.
    fn welcome(&mut self, ui: &mut Ui) {
        let (mut learns, mut leaves) = (false, self.view.tab == Tab::Learn);
        theme::card(ui).show(ui, |ui| {
            ui.set_width(ui.available_width());
            let text = "New here? These experts are trained to reach the flag while whoever clones them gets lost. \
                        Ten short steps show how, and when it cannot work.";
            let mut buttons = |ui: &mut Ui| {
                let start = RichText::new("Start the lesson").color(Palette::of(ui).on_accent);
                learns = ui.add(egui::Button::new(start).fill(Palette::of(ui).accent)).clicked();
                leaves |= ui.button("Not now").clicked();
            };
            if ui.available_width() < WIDE {
                ui.label(text);
                ui.horizontal(buttons);
            } else {
                ui.horizontal(|ui| {
                    ui.label(text);
                    buttons(ui);
                });
            }
        });
        if learns {
            self.view.tab = Tab::Learn;
        }
        if learns || leaves {
            self.is_new = false;
            // Where nothing can be kept, it is said again at the next visit.
            let _ = self.host.keep("visited", "yes");
        }
    }

    fn show_headline(&mut self, ui: &mut Ui) {
        headline::show_sentence(ui, self);
        ui.add_space(4.0);
        theme::card(ui).show(ui, |ui| {
            ui.set_width(ui.available_width());
            headline::show(ui, self);
            compare::show(ui, self);
        });
    }

    /// What has gone wrong, and what can be done about it.
    fn show_messages(&mut self, ui: &mut Ui) {
        let palette = Palette::of(ui);
        let message = |ui: &mut Ui, sentence: &str, buttons: &[&str]| -> Option<usize> {
            theme::card(ui)
                .stroke(egui::Stroke::new(1.5, palette.warning))
                .show(ui, |ui| {
                    let say = |ui: &mut Ui| {
                        let label = ui.label(RichText::new(sentence).color(palette.warning));
                        ui.ctx().accesskit_node_builder(label.id, |node| node.set_role(egui::Role::Alert));
                    };
                    let offer = |ui: &mut Ui| {
                        let mut clicked = None;
                        for (index, button) in buttons.iter().enumerate() {
                            clicked = ui.button(*button).clicked().then_some(index).or(clicked);
                        }
                        clicked
                    };
                    if ui.available_width() < WIDE {
                        say(ui);
                        return ui.horizontal_wrapped(offer).inner;
                    }
                    ui.horizontal_wrapped(|ui| {
                        say(ui);
                        offer(ui)
                    })
                    .inner
                })
                .inner
        };
        if let Session::Failed(sentence) = &self.session {
            let shown = format!("{sentence} What is on the page stays; training needs a new worker.");
            let report = sentence.clone();
            match message(ui, &shown, &["Restart the worker", "Copy the report"]) {
                Some(0) => self.restart_session(),
                Some(_) if self.host.can_copy() => ui.ctx().copy_text(self.host.report(&report)),
                Some(_) => self.notice = Some(NO_CLIPBOARD.to_owned()),
                None => {}
            }
        }
        if self.is_silent() {
            let sentence = "The worker does not answer. It may still be on its way; another can take its place.";
            if message(ui, sentence, &["Restart the worker"]).is_some() {
                self.restart_session();
            }
        }
        if let Some(sentence) = self.notice.clone()
            && message(ui, &sentence, &["Dismiss"]).is_some()
        {
            self.notice = None;
        }
    }

    /// The names of the tabs.
    fn show_tabs(&mut self, ui: &mut Ui) {
        let is_stacked = ui.ctx().content_rect().width() < WIDE;
        let options = TABS.map(|(tab, _, label, help)| (tab, label, help));
        ui.horizontal_wrapped(|ui| {
            choose_wrapped(ui, "Tab", &mut self.view.tab, &options);
            let has_board = matches!(self.view.tab, Tab::Train | Tab::Learn);
            if has_board && !is_stacked && ui.available_width() > 320.0 {
                ui.add_space(SPACE);
                heatmap::color_bar(ui, self.view.color_map);
            }
        });
        ui.add_space(2.0);
    }

    /// The tab that is open.
    fn show_tab(&mut self, ui: &mut Ui, draw: DrawBoard) {
        let is_stacked = ui.ctx().content_rect().width() < WIDE;
        if matches!(self.view.tab, Tab::Train | Tab::Learn) {
            return self.show_board(ui, draw);
        }
        theme::card(ui).show(ui, |ui| {
            ui.set_width(ui.available_width());
            let mut show = |ui: &mut Ui| match self.view.tab {
                Tab::Train | Tab::Learn => {}
                Tab::World => {
                    let mut tab = std::mem::take(&mut self.world);
                    tab.show(ui, self);
                    self.world = tab;
                }
                Tab::Race => {
                    let mut tab = std::mem::take(&mut self.race);
                    tab.show(ui, self);
                    self.race = tab;
                }
                Tab::Sweep => {
                    let mut tab = std::mem::take(&mut self.sweep);
                    tab.show(ui, self);
                    self.sweep = tab;
                }
                Tab::Bench => {
                    let mut tab = std::mem::take(&mut self.bench);
                    tab.show(ui, self);
                    self.bench = tab;
                }
                Tab::Table1 => {
                    let mut tab = std::mem::take(&mut self.table1);
                    tab.show(ui, self);
                    self.table1 = tab;
                }
            };
            if is_stacked {
                // The page itself scrolls.
                show(ui);
            } else {
                ScrollArea::vertical().auto_shrink([false, false]).show(ui, show);
            }
        });
    }

    /// The run that is shown, by `draw`; then what the visitor did to it.
    fn show_board(&mut self, ui: &mut Ui, draw: DrawBoard) {
        let Some(shown) = &self.shown else {
            if self.is_session_alive() {
                ui.label(RichText::new("The first policies are on their way …").color(Palette::of(ui).muted));
            }
            return;
        };
        let touched = draw(shown, ui, &self.view, &self.kept, &mut self.pictures);
        self.touch(touched);
    }

    /// Does what the visitor asked for on the board.
    pub(super) fn touch(&mut self, touched: Touched) {
        if touched.cell.is_some() {
            self.view.cell = touched.cell;
        }
        if let Some(clones) = touched.clones {
            self.show_clones(clones);
        }
        if let Some(beta) = touched.continue_with {
            self.continue_with(beta);
        } else if let Some(update) = touched.update {
            self.seek(update);
        }
    }

    fn show_windows(&mut self, ui: &mut Ui) {
        if self.view.is_help_open && help::show(ui) {
            self.view.is_help_open = false;
        }
        if self.view.is_table_open {
            policy_table::show(ui, self);
        }
        commands::show_palette(ui.ctx(), self);
    }
}
