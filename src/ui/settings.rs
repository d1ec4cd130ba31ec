//! How the page looks to this visitor: kept for the next visit, and no part of a link.

use egui::{Context, RichText, ThemePreference, Ui};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::app::App;
use super::theme::{self, Palette};
use super::widgets::choose;
use crate::picture::COLOR_MAPS;

/// What a visitor prefers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Preferences {
    pub theme: Theme,
    /// Place in [`crate::picture::COLOR_MAPS`].
    pub color_map: usize,
    /// Times the usual size.
    pub text_size: f32,
    pub motion: Motion,
    /// Whether every control's explanation stands beside it.
    pub explains: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Theme {
    System,
    Light,
    Dark,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Motion {
    System,
    Less,
}

impl Default for Preferences {
    fn default() -> Self {
        Preferences { theme: Theme::System, color_map: 0, text_size: 1.0, motion: Motion::System, explains: false }
    }
}

impl Preferences {
    /// What was kept, maybe by another version: what is not known here is as usual, and nothing else with it.
    fn recalled(text: &str) -> Preferences {
        let read = |fields: &Map<String, Value>| serde_json::from_value(Value::Object(fields.clone()));
        let usual = serde_json::to_value(Preferences::default()).unwrap_or_default();
        let kept: Map<String, Value> = serde_json::from_str(text).unwrap_or_default();
        let mut known = Map::new();
        for (name, value) in kept.into_iter().filter(|(name, _)| usual.get(name).is_some()) {
            known.insert(name.clone(), value);
            if read(&known).map(|_: Preferences| ()).is_err() {
                known.remove(&name);
            }
        }
        let recalled: Preferences = read(&known).unwrap_or_default();
        let usual = Preferences::default();
        let has_size = TEXT_SIZES.iter().any(|(size, ..)| *size == recalled.text_size);
        Preferences {
            text_size: if has_size { recalled.text_size } else { usual.text_size },
            color_map: if recalled.color_map < COLOR_MAPS.len() { recalled.color_map } else { usual.color_map },
            ..recalled
        }
    }
}

/// Sizes of text on offer.
pub const TEXT_SIZES: [(f32, &str, &str); 4] = [
    (1.0, "100 %", "As designed"),
    (1.15, "115 %", "A little larger"),
    (1.3, "130 %", "Larger"),
    (1.6, "160 %", "Much larger: for the last row"),
];

const NAME: &str = "preferences";

impl App {
    /// Takes up what was preferred at the last visit.
    pub(super) fn recall_preferences(&mut self, ctx: &Context) {
        self.preferences = self.host.kept(NAME).map_or(Preferences::default(), |text| Preferences::recalled(&text));
        self.apply_preferences(ctx);
    }

    /// Prefers something else from now on.
    pub fn prefer(&mut self, preferences: Preferences, ctx: &Context) {
        if preferences != self.preferences {
            self.preferences = preferences;
            self.apply_preferences(ctx);
            let Ok(text) = serde_json::to_string(&preferences) else { return };
            if let Err(sentence) = self.host.keep(NAME, &text)
                && !std::mem::replace(&mut self.is_forgetful, true)
            {
                self.notice = Some(format!("{sentence} What you set here holds for this visit."));
            }
        }
    }

    pub(super) fn apply_preferences(&mut self, ctx: &Context) {
        self.view.color_map = self.preferences.color_map;
        let theme = match self.preferences.theme {
            Theme::System => ThemePreference::System,
            Theme::Light => ThemePreference::Light,
            Theme::Dark => ThemePreference::Dark,
        };
        ctx.set_theme(theme);
        self.host.set_theme(theme);
        ctx.set_zoom_factor(self.preferences.text_size);
        theme::set_motion(ctx, self.preferences.motion == Motion::System && !self.host.wants_less_motion());
    }
}

/// The menu of settings.
pub fn show(ui: &mut Ui, app: &mut App) {
    let palette = Palette::of(ui);
    let mut now = app.preferences;
    let head = |ui: &mut Ui, text: &str| _ = ui.label(RichText::new(text).small().color(palette.muted));
    ui.set_max_width(320.0);
    head(ui, "Theme");
    let themes = [
        (Theme::System, "system", "As the system has it"),
        (Theme::Light, "light", "Dark on light"),
        (Theme::Dark, "dark", "Light on dark"),
    ];
    choose(ui, "Theme", &mut now.theme, &themes);
    head(ui, "Colours of the heatmaps");
    let maps: Vec<(usize, &str, &str)> =
        COLOR_MAPS.iter().enumerate().map(|(index, map)| (index, map.title, map.summary)).collect();
    choose(ui, "Colours", &mut now.color_map, &maps);
    head(ui, "Text size");
    choose(ui, "Text size", &mut now.text_size, &TEXT_SIZES);
    head(ui, "Motion");
    let motions = [
        (Motion::System, "as the system", "Races move unless the system asks for less motion"),
        (Motion::Less, "less", "Nothing moves by itself: a race shows its end at once"),
    ];
    choose(ui, "Motion", &mut now.motion, &motions);
    ui.checkbox(&mut now.explains, "Explain every control")
        .on_hover_text("What a control does, the paper's value and equation stand under it; without a pointer, too");
    app.prefer(now, ui.ctx());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_preference_of_another_version_leaves_the_others_as_they_are() {
        let usual = Preferences::default();
        for (kept, expected) in [
            (
                r#"{"theme":"Sepia","text_size":1.6,"explains":true,"font":"big"}"#,
                Preferences { text_size: 1.6, explains: true, ..usual },
            ),
            (r#"{"color_map":-1,"theme":"Dark"}"#, Preferences { theme: Theme::Dark, ..usual }),
            (r#"{"color_map":99,"motion":"Less"}"#, Preferences { motion: Motion::Less, ..usual }),
            (r#"{"text_size":1e300,"color_map":1}"#, Preferences { color_map: 1, ..usual }),
            ("[1]", usual),
            ("{", usual),
        ] {
            assert_eq!(Preferences::recalled(kept), expected, "{kept}");
        }
        // Read in no time, too.
        let names: Vec<String> = (0..20_000).map(|name| format!("\"{name}\":1")).collect();
        assert_eq!(Preferences::recalled(&format!("{{{}}}", names.join(","))), usual);
        let own =
            Preferences { theme: Theme::Light, color_map: 2, text_size: 1.15, motion: Motion::Less, explains: true };
        assert_eq!(Preferences::recalled(&serde_json::to_string(&own).unwrap()), own);
    }
}
