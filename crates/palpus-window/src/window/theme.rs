//! The theme of the window: text sizes, and colours of controls.
//!
//! Sizes are in points. A point is one pixel; Ctrl with + and − scales everything. The values that
//! matter during a run (state, force, torque) are as large as a headline, so that they are legible
//! from two metres.

use eframe::egui::{
    self, Color32, Context, CornerRadius, FontFamily, FontId, Margin, RichText, Stroke, TextStyle, Visuals,
};

use super::view3d::colour;
use crate::picture::Rgb;
use crate::style::Theme;

/// Size of small letters, points.
const SMALL: f32 = 13.0;
/// Size of ordinary letters, points.
const BODY: f32 = 15.5;
/// Size of the letters of headings, points.
const HEADING: f32 = 18.0;
/// Size of text that is legible from a distance.
const LARGE: f32 = 27.0;
/// Radius of the corners of controls, points.
const ROUND: u8 = 5;

/// The colours of panels and controls in a theme.
struct PanelColours {
    fill: Rgb,
    raised: Rgb,
    control: Rgb,
    hovered: Rgb,
    pressed: Rgb,
    line: Rgb,
    text: Rgb,
    faint: Rgb,
    accent: Rgb,
    chosen: Rgb,
    error: Rgb,
    warning: Rgb,
}

const LIGHT: PanelColours = PanelColours {
    fill: [243, 245, 248],
    raised: [255, 255, 255],
    control: [226, 231, 238],
    hovered: [212, 220, 231],
    pressed: [194, 206, 223],
    line: [206, 213, 223],
    text: [28, 33, 43],
    faint: [92, 100, 114],
    accent: [18, 84, 204],
    chosen: [190, 211, 248],
    error: [190, 18, 30],
    warning: [168, 92, 0],
};

const DARK: PanelColours = PanelColours {
    fill: [21, 24, 30],
    raised: [29, 33, 41],
    control: [44, 50, 61],
    hovered: [56, 64, 78],
    pressed: [70, 80, 98],
    line: [50, 56, 68],
    text: [232, 235, 241],
    faint: [158, 166, 180],
    accent: [96, 164, 255],
    chosen: [36, 78, 138],
    error: [255, 104, 104],
    warning: [255, 186, 84],
};

/// Sets text sizes and colours, and the current theme.
pub(super) fn apply_theme(context: &Context, theme: Theme) {
    for (egui_theme, panel, visuals) in
        [(egui::Theme::Light, &LIGHT, Visuals::light()), (egui::Theme::Dark, &DARK, Visuals::dark())]
    {
        context.style_mut_of(egui_theme, |style| {
            let font = |size, family: FontFamily| FontId::new(size, family);
            style.text_styles = [
                (TextStyle::Small, font(SMALL, FontFamily::Proportional)),
                (TextStyle::Body, font(BODY, FontFamily::Proportional)),
                (TextStyle::Button, font(BODY, FontFamily::Proportional)),
                (TextStyle::Heading, font(HEADING, FontFamily::Proportional)),
                (TextStyle::Monospace, font(BODY, FontFamily::Monospace)),
            ]
            .into();
            let spacing = &mut style.spacing;
            spacing.item_spacing = egui::vec2(7.0, 6.0);
            spacing.button_padding = egui::vec2(9.0, 4.0);
            spacing.interact_size = egui::vec2(40.0, 24.0);
            spacing.slider_rail_height = 5.0;
            spacing.window_margin = Margin::same(16);
            // Margins of menus and dialogs.
            spacing.menu_margin = Margin::same(14);
            spacing.icon_width = 17.0;
            spacing.icon_width_inner = 10.0;
            style.visuals = coloured(visuals, panel);
        });
    }
    context.set_theme(match theme {
        Theme::Light => egui::ThemePreference::Light,
        Theme::Dark => egui::ThemePreference::Dark,
    });
}

fn coloured(mut visuals: Visuals, panel: &PanelColours) -> Visuals {
    let stroke = |width, rgb| Stroke::new(width, colour(rgb));
    visuals.panel_fill = colour(panel.fill);
    visuals.window_fill = colour(panel.raised);
    visuals.window_stroke = stroke(1.0, panel.line);
    visuals.faint_bg_color = colour(panel.raised);
    visuals.extreme_bg_color = colour(panel.control);
    visuals.weak_text_color = Some(colour(panel.faint));
    visuals.error_fg_color = colour(panel.error);
    visuals.warn_fg_color = colour(panel.warning);
    visuals.hyperlink_color = colour(panel.accent);
    visuals.selection.bg_fill = colour(panel.chosen);
    visuals.selection.stroke = stroke(1.0, panel.text);
    visuals.slider_trailing_fill = true;
    let widgets = &mut visuals.widgets;
    for (widget, fill, line) in [
        (&mut widgets.noninteractive, panel.fill, panel.line),
        (&mut widgets.inactive, panel.control, panel.control),
        (&mut widgets.hovered, panel.hovered, panel.faint),
        // Pressed controls, and the control with the keyboard focus, which must be visible.
        (&mut widgets.active, panel.pressed, panel.accent),
        (&mut widgets.open, panel.pressed, panel.line),
    ] {
        widget.bg_fill = colour(fill);
        widget.weak_bg_fill = colour(fill);
        widget.bg_stroke = stroke(1.0, line);
        widget.fg_stroke = stroke(1.2, panel.text);
        widget.corner_radius = CornerRadius::same(ROUND);
        widget.expansion = 0.0;
    }
    widgets.active.bg_stroke.width = 2.0;
    visuals
}

/// Returns text that is legible from a distance.
pub(super) fn large(text: impl Into<String>) -> RichText {
    RichText::new(text).size(LARGE)
}

/// Returns the font of [`large`].
pub(super) fn large_font() -> FontId {
    FontId::new(LARGE, FontFamily::Proportional)
}

/// Returns small text, such as the name of a larger item.
pub(super) fn small(text: impl Into<String>) -> RichText {
    RichText::new(text).small().weak()
}

/// Returns a translucent colour with the opacity `part`.
pub(super) fn thin(rgb: Rgb, part: f32) -> Color32 {
    colour(rgb).gamma_multiply(part)
}
