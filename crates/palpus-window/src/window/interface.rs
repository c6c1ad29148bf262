//! What the window shows in a frame, and what mouse and keys do.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use eframe::egui::{self, Color32, Key, RichText, Sense};
use eframe::egui_glow;
use egui_plot::{Line, Plot};
use palpus_device::{Newest, Phase};

use super::Numbers;
use super::gl::{Artist, Drawing, DrawnBody, projection, view};
use super::history::{History, SPAN, Sample};
use crate::camera::{Camera, View};
use crate::marks::{self, Marks, NOMINAL_HEIGHT};
use crate::moment::Moment;
use crate::paint::{COVER_ALONG, COVER_SQUARE, GHOST_COVER};
use crate::picture::{Picture, Rgb};
use crate::scene::Scene;
use crate::style::{Style, Theme};

/// Between two frames; longer where the processor draws, which the loop needs.
const FRAME: Duration = Duration::from_millis(16);
const FRAME_OF_SOFTWARE: Duration = Duration::from_millis(40);
/// rad the view turns for a pixel of the mouse.
const TURN: f32 = 0.008;
/// How much nearer a step of the wheel comes: the exponent for a pixel.
const ZOOM: f32 = 0.0025;
/// Over which time the rate is counted, s.
const RATE_SPAN: f64 = 0.5;
/// Points.
const SIDE: f32 = 260.0;
const KEYS_WIDTH: f32 = 420.0;
const PLOTS: f32 = 190.0;
/// Most balls that are drawn: a thousand dots say as much.
const MOST_DOTS: usize = 1000;

pub(super) struct Interface<'a> {
    scene: Scene,
    style: Style,
    camera: Camera,
    framed: bool,
    moments: Newest<Moment>,
    numbers: &'a mut dyn FnMut() -> Numbers,
    over: &'a AtomicBool,
    closes: &'a dyn Fn() -> bool,
    now: Numbers,
    frozen: bool,
    help: bool,
    history: History,
    counted: (Instant, u64),
    rate: f64,
    artist: Arc<Mutex<Artist>>,
    frame: Duration,
    said: Arc<Mutex<String>>,
    pictures: u32,
}

impl<'a> Interface<'a> {
    pub(super) fn new(
        creation: &eframe::CreationContext<'_>,
        scene: Scene,
        moments: Newest<Moment>,
        numbers: &'a mut dyn FnMut() -> Numbers,
        over: &'a AtomicBool,
        closes: &'a dyn Fn() -> bool,
    ) -> Result<Self, String> {
        let gl = creation.gl.as_ref().ok_or("there is no OpenGL here")?;
        let solids: Vec<_> = scene.bodies.iter().map(|body| body.solid.as_ref()).collect();
        let style = Style { theme: Theme::Dark, ..Style::default() };
        let artist = Artist::new(gl, &solids, style.theme.colours().piece_lightness)?;
        let by_processor = ["llvmpipe", "softpipe", "SwiftShader"].iter().any(|name| artist.renderer.contains(name));
        creation.egui_ctx.set_theme(egui::ThemePreference::Dark);
        // Readable from two metres.
        creation.egui_ctx.set_zoom_factor(1.15);
        Ok(Self {
            camera: Camera::framing(scene.corners(), View::Oblique, 1.5),
            scene,
            style,
            framed: false,
            moments,
            numbers,
            over,
            closes,
            now: Numbers::default(),
            frozen: false,
            help: false,
            history: History::default(),
            counted: (Instant::now(), 0),
            rate: 0.0,
            artist: Arc::new(Mutex::new(artist)),
            frame: if by_processor { FRAME_OF_SOFTWARE } else { FRAME },
            said: Arc::new(Mutex::new("? shows the keys".to_owned())),
            pictures: 0,
        })
    }

    /// Step 1.
    fn take_newest(&mut self) {
        if self.frozen {
            return;
        }
        self.now = (self.numbers)();
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
                self.camera.look(view);
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
            self.framed = false;
            self.camera.look(View::Oblique);
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
        let over = self.over.load(Ordering::Relaxed);
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
                    self.camera.look(view);
                }
            }
            if ui.button("reset (R)").clicked() {
                self.framed = false;
                self.camera.look(View::Oblique);
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
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        let size = rect.size();
        let aspect = f64::from(size.x / size.y.max(1.0));
        if !self.framed {
            self.camera.frame(self.scene.corners(), aspect);
            self.framed = true;
        }
        let moved = response.drag_delta();
        let shift = ui.input(|input| input.modifiers.shift);
        if response.dragged_by(egui::PointerButton::Primary) && !shift {
            self.camera.orbit(f64::from(-moved.x * TURN), f64::from(moved.y * TURN));
        } else if response.dragged() {
            self.camera.pan(f64::from(moved.x), f64::from(moved.y), f64::from(size.y));
        }
        if response.hovered() {
            let (wheel, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            self.camera.zoom(f64::from((wheel * ZOOM).exp() * pinch));
        }
        let colours = self.style.theme.colours();
        ui.painter().rect_filled(rect, 0.0, colour(colours.below));
        let drawing = self.drawing(aspect, f64::from(size.y));
        let artist = Arc::clone(&self.artist);
        let callback = egui_glow::CallbackFn::new(move |_, painter| {
            if let Ok(mut artist) = artist.lock() {
                artist.draw(painter.gl(), &drawing);
            }
        });
        ui.painter().add(egui::PaintCallback { rect, callback: Arc::new(callback) });
    }

    /// What the graphics library is told.
    fn drawing(&self, aspect: f64, height: f64) -> Drawing {
        let view = view(&self.camera);
        let mut drawing = Drawing { projection: projection(&self.camera, aspect), ..Drawing::default() };
        let placed = |pose: &palpus::algebra::Pose| {
            view * glam::DMat4::from_rotation_translation(pose.rotation, pose.translation)
        };
        for (solid, body) in self.scene.bodies.iter().enumerate() {
            let glass = body.look.translucent.then_some((COVER_SQUARE, COVER_ALONG));
            let (pieces, wireframe) = (body.look.pieces, body.look.wireframe);
            let model_view = placed(&body.pose);
            drawing.bodies.push(DrawnBody { solid, model_view, colour: body.colour, pieces, wireframe, glass });
        }
        if let (Some(moment), Some(probe)) = (&self.scene.moment, self.scene.bodies.first())
            && self.scene.is_device_apart(moment, probe)
        {
            let model_view = placed(&(self.scene.moment_pose * moment.device));
            let glass = Some((0.5 * GHOST_COVER, GHOST_COVER));
            drawing.bodies.push(DrawnBody { model_view, glass, wireframe: false, ..drawing.bodies[0] });
        }
        let [_, _, back] = self.camera.axes();
        let eye = self.camera.eye();
        let metres = |point: glam::DVec3, pixels: f64| {
            let depth = (eye - point).dot(back).max(self.camera.nearest());
            self.camera.metres_per_pixel(depth, NOMINAL_HEIGHT) * pixels * (NOMINAL_HEIGHT / height).max(1.0)
        };
        let marks = Marks::of(&self.scene, &self.style, &metres);
        for dot in marks.dots.iter().take(MOST_DOTS) {
            let radius = metres(dot.point, dot.radius);
            drawing.mark(&view, &marks::ball(dot.point, radius), dot.colour);
        }
        for (triangles, colour) in &marks.solids {
            drawing.mark(&view, triangles, *colour);
        }
        drawing
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
        if self.over.load(Ordering::Relaxed) && (self.closes)() {
            context.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        context.request_repaint_after(self.frame);
    }

    fn on_exit(&mut self, gl: Option<&eframe::glow::Context>) {
        if let (Some(gl), Ok(artist)) = (gl, self.artist.lock()) {
            artist.destroy(gl);
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

fn colour(rgb: Rgb) -> Color32 {
    Color32::from_rgb(rgb[0], rgb[1], rgb[2])
}

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
