//! What the window shows in a frame, and what mouse and keys do.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use eframe::egui::{self, Key, RichText};
use egui_plot::{Line, Plot};
use palpus_device::{Newest, Phase};

use super::history::{History, SPAN, Sample};
use super::run::{Numbers, Run};
use super::view3d::{View3d, colour};
use crate::camera::View;
use crate::moment::Moment;
use crate::picture::{Picture, Rgb};
use crate::scene::Scene;
use crate::style::{Style, Theme};

/// Over which time the rate is counted, s.
const RATE_SPAN: f64 = 0.5;
/// Points.
const SIDE: f32 = 260.0;
const KEYS_WIDTH: f32 = 420.0;
const PLOTS: f32 = 190.0;
pub(super) struct Interface<'a> {
    scene: Scene,
    style: Style,
    view: View3d,
    moments: Newest<Moment>,
    run: &'a mut dyn Run,
    now: Numbers,
    frozen: bool,
    help: bool,
    history: History,
    counted: (Instant, u64),
    rate: f64,
    said: Arc<Mutex<String>>,
    pictures: u32,
}

impl<'a> Interface<'a> {
    pub(super) fn new(
        creation: &eframe::CreationContext<'_>,
        scene: Scene,
        moments: Newest<Moment>,
        run: &'a mut dyn Run,
    ) -> Result<Self, String> {
        let style = Style { theme: Theme::Dark, ..Style::default() };
        let view = View3d::new(creation, &scene, &style)?;
        creation.egui_ctx.set_theme(egui::ThemePreference::Dark);
        // Readable from two metres.
        creation.egui_ctx.set_zoom_factor(1.15);
        Ok(Self {
            view,
            scene,
            style,
            moments,
            run,
            now: Numbers::default(),
            frozen: false,
            help: false,
            history: History::default(),
            counted: (Instant::now(), 0),
            rate: 0.0,
            said: Arc::new(Mutex::new("? shows the keys".to_owned())),
            pictures: 0,
        })
    }

    /// Step 1.
    fn take_newest(&mut self) {
        if self.frozen {
            return;
        }
        self.now = self.run.numbers();
        let moment = self.moments.get();
        let overlapping = moment.contacts.iter().filter(|contact| contact.separation < 0.0).count();
        if let Some(probe) = self.scene.bodies.first_mut() {
            probe.pose = self.scene.moment_pose * moment.tool;
        }
        match &mut self.scene.moment {
            Some(shown) => shown.clone_from(moment),
            none => *none = Some(moment.clone()),
        }
        self.history.push(Sample {
            time: self.now.time,
            force: self.now.force,
            torque: self.now.torque * 1e3,
            query: self.now.query * 1e6,
            contacts: f64::from(self.now.contacts),
            overlapping: overlapping as f64,
        });
        let passed = self.counted.0.elapsed().as_secs_f64();
        if passed > RATE_SPAN {
            self.rate = (self.now.ticks - self.counted.1) as f64 / passed;
            self.counted = (Instant::now(), self.now.ticks);
        }
    }

    /// Step 2.
    fn keys(&mut self, context: &egui::Context) {
        let pressed = |key: Key| context.input(|input| input.key_pressed(key));
        for (key, view) in VIEWS {
            if pressed(key) {
                self.view.look(view);
            }
        }
        for (key, on) in [
            (Key::Space, &mut self.frozen),
            (Key::Questionmark, &mut self.help),
            (Key::C, &mut self.style.contacts),
            (Key::A, &mut self.style.clusters),
            (Key::F, &mut self.style.wrench),
            (Key::H, &mut self.style.anchors),
        ] {
            *on ^= pressed(key);
        }
        for body in &mut self.scene.bodies {
            body.look.pieces ^= pressed(Key::P);
            body.look.wireframe ^= pressed(Key::W);
        }
        if let Some(environment) = self.scene.bodies.get_mut(1) {
            environment.look.translucent ^= pressed(Key::T);
        }
        if pressed(Key::L) {
            let light = self.style.theme == Theme::Dark;
            self.set_theme(context, if light { Theme::Light } else { Theme::Dark });
        }
        if pressed(Key::R) {
            self.view.see_everything();
        }
        if pressed(Key::S) {
            self.screenshot(context);
        }
    }

    fn set_theme(&mut self, context: &egui::Context, theme: Theme) {
        self.style.theme = theme;
        context.set_theme(match theme {
            Theme::Light => egui::ThemePreference::Light,
            Theme::Dark => egui::ThemePreference::Dark,
        });
        let [of_probe, of_environment] = crate::scene::ShownBody::colours(theme);
        for (body, colour) in self.scene.bodies.iter_mut().zip([of_probe, of_environment]) {
            body.colour = colour;
        }
        self.view.replace(&self.scene, &self.style);
    }

    /// The whole window as a file.
    fn screenshot(&mut self, context: &egui::Context) {
        self.pictures += 1;
        let file = PathBuf::from(format!("palpus-out/window-{}.png", self.pictures));
        let said = Arc::clone(&self.said);
        context.request_screenshot(move |image| {
            let words = match kept(&image, &file) {
                Ok(()) => format!("written: {}", file.display()),
                Err(error) => format!("{} could not be written: {error}", file.display()),
            };
            if let Ok(mut said) = said.lock() {
                *said = words;
            }
        });
    }

    /// The right side: how it goes, what to show, from where.
    fn side(&mut self, ui: &mut egui::Ui) {
        let colours = self.style.theme.colours();
        ui.heading(&self.scene.title);
        let (phase, calm) = said(self.now.phase);
        let over = self.run.is_over();
        let words = if over {
            "the run is over"
        } else if self.frozen {
            "frozen: the loop goes on"
        } else {
            phase
        };
        let colour = if calm && !over { colour(colours.disjoint) } else { colour(colours.sliding) };
        ui.label(RichText::new(words).color(colour).strong());
        ui.separator();
        let now = &self.now;
        let rows = [
            ("rate", format!("{:.0} Hz", self.rate)),
            ("longest step", format!("{:.0} µs", now.worst_step * 1e6)),
            ("late ticks", now.overruns.to_string()),
            ("faults", now.faults.to_string()),
            ("contacts", now.contacts.to_string()),
            ("clusters", self.scene.moment.as_ref().map_or(0, |moment| moment.clusters.len()).to_string()),
            ("force", format!("{:.2} N", now.force)),
            ("torque", format!("{:.1} mN·m", now.torque * 1e3)),
            ("query", format!("{:.1} µs", now.query * 1e6)),
            ("time", format!("{:.1} s", now.time)),
        ];
        egui::Grid::new("numbers").num_columns(2).spacing([24.0, 4.0]).show(ui, |ui| {
            for (name, value) in rows {
                ui.label(name);
                ui.label(RichText::new(value).monospace().strong());
                ui.end_row();
            }
        });
        ui.separator();
        for (words, shown) in [
            ("contacts (C)", &mut self.style.contacts),
            ("forces of clusters (A)", &mut self.style.clusters),
            ("force and torque (F)", &mut self.style.wrench),
            ("where friction holds (H)", &mut self.style.anchors),
        ] {
            ui.checkbox(shown, words);
        }
        for (body, name) in self.scene.bodies.iter_mut().zip(["probe", "environment"]) {
            ui.horizontal(|ui| {
                ui.label(name);
                ui.toggle_value(&mut body.look.pieces, "pieces");
                ui.toggle_value(&mut body.look.wireframe, "wires");
                ui.toggle_value(&mut body.look.translucent, "glass");
            });
        }
        ui.separator();
        ui.horizontal_wrapped(|ui| {
            for ((_, view), name) in VIEWS.into_iter().zip(["front", "right", "top", "back", "left", "bottom"]) {
                if ui.button(name).clicked() {
                    self.view.look(view);
                }
            }
            if ui.button("reset (R)").clicked() {
                self.view.see_everything();
            }
        });
        ui.horizontal_wrapped(|ui| {
            ui.toggle_value(&mut self.frozen, "freeze (Space)");
            if ui.button("picture (S)").clicked() {
                self.screenshot(&ui.ctx().clone());
            }
            if ui.button("light / dark (L)").clicked() {
                let theme = if self.style.theme == Theme::Dark { Theme::Light } else { Theme::Dark };
                self.set_theme(&ui.ctx().clone(), theme);
            }
        });
        ui.separator();
        if let Ok(said) = self.said.lock() {
            ui.label(said.as_str());
        }
    }

    /// Below: the last seconds.
    fn plots(&self, ui: &mut egui::Ui) {
        let colours = self.style.theme.colours();
        let end = self.history.end().max(SPAN);
        ui.columns(4, |columns| {
            let of = |f: fn(&Sample) -> f64| self.history.curve(f);
            plot(&mut columns[0], "force, N", end, vec![(of(|s| s.force), colours.force, 0.0)]);
            plot(&mut columns[1], "torque, mN·m", end, vec![(of(|s| s.torque), colours.torque, 0.0)]);
            plot(&mut columns[2], "query, µs", end, vec![(of(|s| s.query), colours.cluster, 0.0)]);
            let both =
                vec![(of(|s| s.contacts), colours.disjoint, 0.3), (of(|s| s.overlapping), colours.penetrating, 0.5)];
            plot(&mut columns[3], "contacts: apart and overlapping", end, both);
        });
    }

    /// The middle: the scene, and what the mouse does to it.
    fn middle(&mut self, ui: &mut egui::Ui) {
        let area = self.view.place(ui, &self.scene);
        self.view.navigate(ui, &area);
        self.view.draw(ui, &area, &self.scene, &self.style, &[]);
    }
}

impl eframe::App for Interface<'_> {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        self.take_newest();
        self.keys(&context);
        egui::Panel::right("side").default_size(SIDE).show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| self.side(ui));
        });
        egui::Panel::bottom("plots").exact_size(PLOTS).show(ui, |ui| self.plots(ui));
        egui::CentralPanel::no_frame().show(ui, |ui| self.middle(ui));
        if self.help {
            egui::Window::new("keys").default_width(KEYS_WIDTH).open(&mut self.help).show(&context, |ui| {
                ui.label(KEYS);
            });
        }
        if self.run.is_over() && self.run.closes_when_over() {
            context.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        context.request_repaint_after(self.view.frame());
    }

    fn on_exit(&mut self, gl: Option<&eframe::glow::Context>) {
        if let Some(gl) = gl {
            self.view.destroy(gl);
        }
    }
}

const VIEWS: [(Key, View); 6] = [
    (Key::Num1, View::Front),
    (Key::Num2, View::Right),
    (Key::Num3, View::Top),
    (Key::Num4, View::Back),
    (Key::Num5, View::Left),
    (Key::Num6, View::Bottom),
];

const KEYS: &str = "drag: turn\nshift, middle or right drag: move\nwheel: nearer\n1 to 6: standard views\nR: everything in view\n\
    Space: freeze the picture (the loop goes on)\nS: picture of the window\nC, A, F, H: contacts, cluster forces, force and torque, friction\n\
    P, W: pieces in colours, wires\nT: environment of glass\nL: light or dark\n?: these keys";

/// Where the engagement stands, and whether that is as it should be.
fn said(phase: Phase) -> (&'static str, bool) {
    match phase {
        Phase::Engaged => ("engaged", true),
        Phase::Idle => ("press a button to feel it", true),
        Phase::Waiting => ("out of contact first", false),
        Phase::Ramping => ("engaging", true),
        Phase::Faulted => ("a fault: no force", false),
        Phase::Stopped => ("stopped by a fault", false),
    }
}

/// One plot: its curves, their colours, and how much of what is below them is filled.
fn plot(ui: &mut egui::Ui, title: &str, end: f64, curves: Vec<(Vec<[f64; 2]>, Rgb, f32)>) {
    ui.label(title);
    Plot::new(title)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .include_y(0.0)
        .include_y(LEAST_RANGE)
        .include_x(end - SPAN)
        .include_x(end)
        .show(ui, |plot| {
            for (points, rgb, filled) in curves {
                let line = Line::new(title, points).color(colour(rgb));
                plot.line(if filled > 0.0 { line.fill(0.0).fill_alpha(filled) } else { line });
            }
        });
}

/// So that noise about zero does not fill a plot.
const LEAST_RANGE: f64 = 0.5;

/// Writes what was on the screen.
fn kept(image: &egui::ColorImage, file: &std::path::Path) -> std::io::Result<()> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let [width, height] = image.size;
    let mut picture = Picture::new(width, height, [0; 3]);
    for (k, pixel) in image.pixels.iter().enumerate() {
        picture.set_pixel(k % width, k / width, [pixel.r(), pixel.g(), pixel.b()]);
    }
    picture.write_png(file)
}
