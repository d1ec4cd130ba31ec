//! A table of figures that sorts by any of its columns.

use egui::accesskit::SortDirection;
use egui::{Color32, Grid, Id, RichText, Role, ScrollArea, Ui, UiBuilder};

use super::theme::Palette;

/// A column's head.
pub struct Column {
    title: String,
    help: String,
}

impl Column {
    pub fn new(title: &str, help: &str) -> Column {
        Column { title: title.to_owned(), help: help.to_owned() }
    }
}

/// A figure: how it is written, and what it sorts by.
pub struct Cell {
    text: String,
    value: f64,
    color: Option<Color32>,
    /// Made when somebody points at it.
    hover: Option<Hint>,
}

type Hint = Box<dyn FnOnce(&Ui) -> String>;

impl Cell {
    pub fn number(value: f64, text: String) -> Cell {
        Cell { text, value, color: None, hover: None }
    }

    pub fn colored(self, color: Color32) -> Cell {
        Cell { color: Some(color), ..self }
    }

    pub fn hover(self, text: &str) -> Cell {
        let text = text.to_owned();
        self.hover_with(|_| text)
    }

    pub fn hover_with(self, text: impl FnOnce(&Ui) -> String + 'static) -> Cell {
        Cell { hover: Some(Box::new(text)), ..self }
    }

    pub fn suffix(mut self, text: &str) -> Cell {
        self.text += text;
        self
    }
}

/// Draws a table; a click on a column's head sorts by it, another turns the order round.
pub fn table(ui: &mut Ui, id: &'static str, columns: &[Column], mut rows: Vec<Vec<Cell>>) {
    let palette = Palette::of(ui);
    let key = egui::Id::unique((id, "order"));
    let (mut by, mut is_falling) = ui.data(|data| data.get_temp::<(usize, bool)>(key)).unwrap_or((0, false));
    by = by.min(columns.len() - 1);
    rows.sort_by(|a, b| {
        let order = a[by].value.total_cmp(&b[by].value);
        if is_falling { order.reverse() } else { order }
    });
    ScrollArea::horizontal().id_salt(id).show(ui, |ui| {
        ui.spacing_mut().button_padding.x = 0.0;
        ui.spacing_mut().interact_size.y = 18.0;
        Grid::new(id).striped(true).spacing([14.0, 4.0]).min_col_width(0.0).show(ui, |ui| {
            describe(ui, id);
            let head = row(ui);
            for (index, column) in columns.iter().enumerate() {
                let mark = match index == by {
                    true if is_falling => " ↓",
                    true => " ↑",
                    false => "",
                };
                let text = RichText::new(format!("{}{mark}", column.title)).small().strong();
                let response = cell(ui, head, Role::ColumnHeader, |ui| {
                    if index == by {
                        let order = if is_falling { SortDirection::Descending } else { SortDirection::Ascending };
                        ui.ctx().accesskit_node_builder(ui.unique_id(), |node| node.set_sort_direction(order));
                    }
                    let response = ui.add(egui::Button::new(text).frame(false));
                    response.accessible_name(format!("Sort by {}", column.title))
                });
                if response.on_hover_text(&column.help).clicked() {
                    (by, is_falling) = (index, index == by && !is_falling);
                    ui.data_mut(|data| data.insert_temp(key, (by, is_falling)));
                }
            }
            ui.end_row();
            for figures in rows {
                let row = row(ui);
                for (index, figure) in figures.into_iter().enumerate() {
                    let text = RichText::new(figure.text).small().color(figure.color.unwrap_or(palette.ink));
                    let role = if index == 0 { Role::RowHeader } else { Role::Cell };
                    let label = cell(ui, row, role, |ui| ui.add(egui::Label::new(text).extend()));
                    if let Some(text) = figure.hover {
                        label.on_hover_ui(|ui| {
                            ui.label(text(ui));
                        });
                    }
                }
                ui.end_row();
            }
        });
    });
}

/// Says that what is in `ui` is a table, and what it is called.
pub fn describe(ui: &Ui, name: &str) {
    ui.ctx().accesskit_node_builder(ui.unique_id(), |node| {
        node.set_role(Role::Table);
        node.set_label(name);
    });
}

/// A row of the table that `ui` is, for assistive technology: it takes no room, its cells name it.
pub fn row(ui: &mut Ui) -> Id {
    ui.new_child(UiBuilder::new().accessibility_role(Role::Row)).unique_id()
}

/// A cell of a row.
pub fn cell<R>(ui: &mut Ui, row: Id, role: Role, add: impl FnOnce(&mut Ui) -> R) -> R {
    ui.scope_builder(UiBuilder::new().accessibility_parent(row).accessibility_role(role), add).inner
}
