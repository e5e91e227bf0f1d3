//! What a frame costs, and what it left out.

use egui::{Grid, RichText, Ui};
use strandlight_formats::counted;

use crate::ui::theme;
use crate::viewer::Viewer;
use strandlight_render::gpu::Context;
use strandlight_scene::interactive::{PictureProgress, RenderReport};
use strandlight_scene::material::Outcome;

/// What the window knows of its own frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameTimes {
    /// Milliseconds of the last frame of the window, smoothed.
    pub frame_ms: f64,
    /// Most memory that the process has used, bytes, where the system tells.
    pub peak_bytes: Option<u64>,
}

/// Progress, stages, what was skipped, what the last edit rebuilt, and memory.
pub fn show(ui: &mut Ui, viewer: &Viewer, progress: &PictureProgress, times: FrameTimes) {
    let (report, device) = (viewer.report(), viewer.renderer().device());
    let stats = &report.stats;
    Grid::new("counts").num_columns(2).show(ui, |ui| {
        let mut line = |name: &str, value: String, help: &str| {
            ui.label(RichText::new(name).color(theme::WEAK))
                .on_hover_text(help);
            ui.label(value);
            ui.end_row();
        };
        let noise = match progress.noise {
            Some(noise) => format!(", noise {:.1} %", 100.0 * noise),
            None => String::new(),
        };
        match progress.total_samples {
            0 => line(
                "Picture",
                format!("{} visible points", stats.visible_points),
                "Drawn by a visibility list, without samples and noise",
            ),
            total => line(
                "Samples",
                format!("{} of {total}{noise}", progress.samples),
                "Samples per pixel so far, and the estimated remaining noise",
            ),
        }
        line(
            "Window",
            format!("{:.1} ms per frame", times.frame_ms),
            "Time between window frames while rendering",
        );
        if let Some(reason) = viewer.cpu_reason() {
            line("Renderer", stats.backend.clone(), "What draws the picture");
            line("", reason.to_string(), "Why the CPU draws");
        }
        if let Some(context) = device {
            line("Device", context.adapter_name.clone(), "Graphics adapter");
            let kind = match context.is_software() {
                true => format!("{} (software)", context.backend),
                false => context.backend.clone(),
            };
            line("Driver", kind, "Graphics API");
        }
        let groom = viewer.session().groom();
        let (n_strands, n_points) = (groom.n_strands(), groom.points.len());
        let drawn = match stats.points == n_points {
            true => String::new(),
            false => format!(", drawn with {}", stats.points),
        };
        line(
            "Hair",
            format!(
                "{}, {}{drawn}",
                counted(n_strands, "strand", "strands"),
                counted(n_points, "point", "points")
            ),
            "As the groom's file has them; long segments are drawn in pieces",
        );
        line(
            "Lights",
            format!(
                "{}, {} sweeps, {} shadow maps",
                stats.lights, stats.sweeps, stats.shadow_maps
            ),
            "Enabled lights, shadow sweep directions, and shadow maps",
        );
        if device.is_some() {
            line(
                "Memory",
                format!("{:.0} MB device", report.device_bytes as f64 / 1e6),
                "GPU buffers and textures",
            );
        }
        if let Some(peak) = times.peak_bytes {
            line(
                "Peak",
                format!("{:.0} MB process", peak as f64 / 1e6),
                "Peak memory of the process",
            );
        }
    });
    stages(ui, report, device.is_none_or(Context::is_software));
    terms(ui, report);
    if device.is_some() {
        edit(ui, report);
    }
}

fn stages(ui: &mut Ui, report: &RenderReport, is_software: bool) {
    if report.stages.is_empty() {
        return;
    }
    ui.label(RichText::new("Work since the last edit").strong());
    Grid::new("stages")
        .num_columns(3)
        .striped(true)
        .show(ui, |ui| {
            for stage in &report.stages {
                ui.label(stage.name);
                ui.label(format!("{} x", stage.runs));
                // Time stamps of a processor that draws are no GPU's.
                match stage.gpu_milliseconds.filter(|_| !is_software) {
                    Some(ms) => ui.label(format!("{ms:.2} ms (GPU)")),
                    None if stage.milliseconds > 0.0 => {
                        ui.label(format!("{:.1} ms (CPU time)", stage.milliseconds))
                    }
                    None => ui.label(RichText::new("not timed").color(theme::WEAK)),
                };
                ui.end_row();
            }
        });
}

fn terms(ui: &mut Ui, report: &RenderReport) {
    let stats = &report.stats;
    if !stats.terms.is_empty() {
        ui.label(RichText::new("Point-light pairs").strong());
        Grid::new("terms")
            .num_columns(3)
            .striped(true)
            .show(ui, |ui| {
                for term in &stats.terms {
                    let all = (term.products + term.skipped).max(1);
                    ui.label(term.name);
                    ui.label(format!("{:.2} M", term.products as f64 / 1e6));
                    ui.label(format!(
                        "{:.0} % skipped",
                        100.0 * term.skipped as f64 / all as f64
                    ));
                    ui.end_row();
                }
            });
    }
    if stats.points_skipped > 0 {
        let what = match stats.visible_points {
            0 => "outside the view",
            _ => "that the picture does not show",
        };
        ui.label(format!(
            "{} {what}, not shaded",
            counted(stats.points_skipped, "point", "points")
        ));
    }
    for skipped in &stats.skipped {
        ui.label(RichText::new(format!("Skipped: {skipped}")).color(theme::WEAK));
    }
}

fn edit(ui: &mut Ui, report: &RenderReport) {
    let counts = report.counts;
    ui.label(RichText::new("Last edit").strong());
    ui.label(format!(
        "Created {} buffers, {} textures, {} pipelines; {} geometry uploads",
        counts.buffers, counts.textures, counts.pipelines, counts.geometry_uploads
    ));
    let Some(edit) = &report.edit else {
        return;
    };
    Grid::new("parts")
        .num_columns(3)
        .striped(true)
        .show(ui, |ui| {
            for part in &edit.parts {
                if part.outcome == Outcome::Absent {
                    continue;
                }
                ui.label(part.name);
                if part.outcome == Outcome::Rebuilt {
                    ui.label("recomputed");
                    ui.label(format!("{:.0} µs, {} B", part.microseconds, part.gpu_bytes));
                } else {
                    ui.label(RichText::new("reused").color(theme::WEAK));
                    ui.label("");
                }
                ui.end_row();
            }
        });
}
