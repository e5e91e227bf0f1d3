//! Colours and spacing: neutral greys, so that the panel does not sway the eye's judgement of hair.

use egui::{
    Color32, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Stroke, TextStyle, Vec2,
};

/// Around the picture and between its strands where it is see-through.
pub const BACKDROP: Color32 = Color32::from_gray(18);
/// Behind the controls.
pub const PANEL: Color32 = Color32::from_gray(33);
/// What is chosen, and the filled part of sliders.
pub const ACCENT: Color32 = Color32::from_rgb(74, 128, 176);
/// Ranges, units and other asides.
pub const WEAK: Color32 = Color32::from_gray(138);
/// Something to be noticed.
pub const WARNING: Color32 = Color32::from_rgb(226, 170, 84);
/// Something that failed.
pub const ERROR: Color32 = Color32::from_rgb(232, 110, 100);

/// Width of the panel in points.
pub const PANEL_WIDTH: f32 = 348.0;
/// Least width of it: names, numbers and a short slider.
pub const PANEL_LEAST: f32 = 290.0;

/// One font for everything: a second would be a thirtieth of the program.
fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::empty();
    let (name, data) = ("Ubuntu-Light", epaint_default_fonts::UBUNTU_LIGHT);
    let data = FontData::from_static(data);
    fonts.font_data.insert(name.to_owned(), data.into());
    for family in [FontFamily::Proportional, FontFamily::Monospace] {
        fonts.families.insert(family, vec![name.to_owned()]);
    }
    fonts
}

/// Dresses `ctx`.
pub fn apply(ctx: &egui::Context) {
    ctx.set_fonts(fonts());
    ctx.set_theme(egui::Theme::Dark);
    // A second pass would apply clicks twice.
    ctx.options_mut(|options| {
        options.max_passes = std::num::NonZeroUsize::MIN;
        // By the time of frames a quick click takes long where frames are slow.
        options.input_options.max_click_duration = f64::INFINITY;
    });
    ctx.style_mut_of(egui::Theme::Dark, |style| {
        style.text_styles = [
            (TextStyle::Heading, FontId::proportional(14.5)),
            (TextStyle::Body, FontId::proportional(13.0)),
            (TextStyle::Button, FontId::proportional(13.0)),
            (TextStyle::Small, FontId::proportional(11.0)),
            (TextStyle::Monospace, FontId::proportional(12.0)),
        ]
        .into();
        style.spacing.item_spacing = Vec2::new(6.0, 4.0);
        style.spacing.button_padding = Vec2::new(7.0, 2.0);
        style.spacing.interact_size = Vec2::new(34.0, 20.0);
        style.spacing.tooltip_width = 320.0;
        style.spacing.slider_rail_height = 4.0;
        style.interaction.tooltip_delay = 0.4;
        style.animation_time = 0.0;
        let visuals = &mut style.visuals;
        visuals.panel_fill = PANEL;
        visuals.window_fill = Color32::from_gray(38);
        visuals.window_stroke = Stroke::new(1.0, Color32::from_gray(62));
        visuals.extreme_bg_color = Color32::from_gray(22);
        visuals.faint_bg_color = Color32::from_gray(38);
        visuals.warn_fg_color = WARNING;
        visuals.error_fg_color = ERROR;
        visuals.selection.bg_fill = ACCENT;
        visuals.selection.stroke = Stroke::new(1.0, Color32::WHITE);
        visuals.slider_trailing_fill = true;
        visuals.window_corner_radius = CornerRadius::same(6);
        visuals.widgets.noninteractive.fg_stroke.color = Color32::from_gray(206);
        visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_gray(52));
        visuals.widgets.inactive.fg_stroke.color = Color32::from_gray(206);
        visuals.widgets.inactive.bg_fill = Color32::from_gray(54);
        visuals.widgets.inactive.weak_bg_fill = Color32::from_gray(50);
        visuals.widgets.hovered.weak_bg_fill = Color32::from_gray(64);
        visuals.widgets.hovered.bg_stroke = Stroke::new(1.0, Color32::from_gray(96));
        visuals.widgets.active.weak_bg_fill = Color32::from_gray(76);
        for widget in [
            &mut visuals.widgets.inactive,
            &mut visuals.widgets.hovered,
            &mut visuals.widgets.active,
            &mut visuals.widgets.open,
        ] {
            widget.corner_radius = CornerRadius::same(3);
            widget.expansion = 0.0;
        }
    });
}

/// Text that is read on any picture: dark under light.
pub fn outlined(
    painter: &egui::Painter,
    at: egui::Pos2,
    align: egui::Align2,
    text: &str,
    font: &egui::FontId,
) {
    for (shift, gray) in [(1.0, 0), (0.0, 235)] {
        let at = at + egui::Vec2::splat(shift);
        let colour = egui::Color32::from_gray(gray);
        painter.text(at, align, text, font.clone(), colour);
    }
}

#[cfg(test)]
mod tests {
    use egui::{Event, Modifiers, PointerButton, RawInput, Rect, Sense, pos2, vec2};

    use super::*;

    #[test]
    fn a_click_over_slow_frames_is_a_click() {
        let ctx = egui::Context::default();
        apply(&ctx);
        let pos = pos2(20.0, 20.0);
        let button = |pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        let frame = |time: f64, event: Event| {
            let input = RawInput {
                time: Some(time),
                screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), vec2(100.0, 100.0))),
                events: vec![event],
                ..RawInput::default()
            };
            let mut is_clicked = false;
            let output = ctx.run_ui(input, |ui| {
                let rect = Rect::from_min_size(pos2(5.0, 5.0), vec2(50.0, 50.0));
                is_clicked = ui.allocate_rect(rect, Sense::click_and_drag()).clicked();
            });
            output.drop_without_applying_deltas();
            is_clicked
        };
        for time in 0..3 {
            frame(f64::from(time), Event::PointerMoved(pos));
        }
        assert!(!frame(3.0, button(true)));
        assert!(
            frame(6.0, button(false)),
            "the next frame took three seconds"
        );
    }
}
