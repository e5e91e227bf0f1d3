//! What opens over the window fits into it.

use egui::{Modal, ModalResponse, Response, ScrollArea, Ui, Vec2};

/// Frames and margins of what opens over the window, points.
const AROUND: Vec2 = egui::vec2(48.0, 40.0);

/// Shows `content`, which is told how wide it may be, below `above` points of other things; what is larger than the window is
/// scrolled to.
pub fn fitted<R>(ui: &mut Ui, above: f32, content: impl FnOnce(&mut Ui, f32) -> R) -> R {
    let around = AROUND + egui::vec2(0.0, above);
    let room = (ui.ctx().content_rect().size() - around).max(Vec2::splat(60.0));
    // What opens has less at first, however large the window is.
    ui.set_max_size(room);
    let area = ScrollArea::both().max_width(room.x).max_height(room.y);
    area.show(ui, |ui| content(ui, room.x)).inner
}

/// A dialog that is [`fitted`].
pub fn fitted_modal<R>(
    ui: &Ui,
    id: &str,
    content: impl FnOnce(&mut Ui, f32) -> R,
) -> ModalResponse<R> {
    let modal = Modal::new(egui::Id::unique(id));
    modal.show(ui.ctx(), |ui| fitted(ui, 0.0, content))
}

/// A menu whose entries are scrolled to in a low window.
pub fn fitted_menu(ui: &mut Ui, name: &str, entries: impl FnOnce(&mut Ui)) -> Response {
    let room = ui.ctx().content_rect().height() - AROUND.y;
    let menu = ui.menu_button(name, |ui| {
        ui.set_max_height(room);
        ScrollArea::vertical().max_height(room).show(ui, entries);
    });
    menu.response
}
