//! Draws the bodies and marks of a scene with OpenGL 3.3 or OpenGL ES 3.0, into egui's current
//! target.
//!
//! 1. A body's triangles are uploaded once, each corner with its normal and the colour of its
//!    piece. Corners with equal data are shared, so a software renderer computes them once. If the
//!    sides of triangles are shown, separate corners are uploaded too, each with the number of its
//!    opposite side.
//! 2. In each frame, opaque bodies are drawn first, then the inner and the outer sides of
//!    translucent bodies, and then the marks. Hidden parts of marks are drawn in a paler colour,
//!    before the visible parts.
//! 3. A body that is transparent around a probe is drawn as an opaque body outside the rectangle
//!    around the probe, and with a program that leaves out pixels inside this rectangle.
//!
//! The light is the same as in `paint`. Positions are transformed into the view's frame in `f64`.
//! In this frame, `f32` is precise enough.
#![allow(unsafe_code)] // Calls of the graphics library (glow), on the thread that owns the context.

mod drawing;

use std::sync::Arc;

use eframe::glow::{self, HasContext};
use glam::{DMat4, DVec3};

use super::canvas::Canvas;
use super::shader::{XRAYS, program};
use crate::paint::HIDDEN;
use crate::solid::Solid;
use crate::style::linear;
use crate::xray::XRay;
use drawing::{BodyPart, CORNER, apart_corners, shared_corners};
pub(crate) use drawing::{Drawing, DrawnBody, projection, view};

/// Texts that only names of software renderers contain.
const PROCESSORS: [&str; 3] = ["llvmpipe", "softpipe", "SwiftShader"];

/// True if a software renderer draws, which competes with the loop for the processor.
pub(crate) fn is_by_processor(gl: &glow::Context) -> bool {
    // SAFETY: the context is current, as egui's creation of an app promises.
    is_software(&unsafe { gl.get_parameter_string(glow::RENDERER) })
}

fn is_software(renderer: &str) -> bool {
    PROCESSORS.iter().any(|name| renderer.contains(name))
}

/// Corners in the graphics library.
struct Held {
    array: glow::VertexArray,
    buffer: glow::Buffer,
    /// Indices of the corners, if corners are shared.
    order: Option<glow::Buffer>,
    count: i32,
}

/// A body's triangles.
struct HeldSolid {
    solid: Arc<Solid>,
    shared: Held,
    /// Created when the sides of triangles are first shown.
    apart: Option<Held>,
}

/// All objects of the graphics library for a scene.
pub(crate) struct GlScene {
    /// Draws everything except the surroundings of a probe.
    plain: Program,
    /// Draws bodies that are transparent around a probe.
    xray: Program,
    solids: Vec<HeldSolid>,
    piece_lightness: f64,
    marks: Held,
    /// `None` only during drawing.
    canvas: Option<Canvas>,
    /// Name of the renderer.
    pub(crate) renderer: String,
    /// See [`is_by_processor`].
    by_processor: bool,
}

/// A program and the places of its uniforms.
struct Program {
    program: glow::Program,
    projection: Option<glow::UniformLocation>,
    model_view: Option<glow::UniformLocation>,
    colour: Option<glow::UniformLocation>,
    glass: Option<glow::UniformLocation>,
    wire: Option<glow::UniformLocation>,
    ends: Option<glow::UniformLocation>,
    sizes: Option<glow::UniformLocation>,
    part: Option<glow::UniformLocation>,
}

impl GlScene {
    /// Compiles the shaders and uploads the solids.
    ///
    /// # Errors
    /// Fails with the message of the graphics library.
    pub(crate) fn new(gl: &glow::Context, solids: &[Arc<Solid>], piece_lightness: f64) -> Result<Self, String> {
        // SAFETY: the context is current, as egui's creation of an app and its callbacks promise.
        unsafe {
            let renderer = gl.get_parameter_string(glow::RENDERER);
            let by_processor = is_software(&renderer);
            let [plain, xray] = [Program::new(gl, by_processor, false)?, Program::new(gl, by_processor, true)?];
            let mut held = Vec::new();
            for solid in solids {
                let mut shared = Held::new(gl)?;
                let (corners, order) = shared_corners(solid, piece_lightness);
                shared.upload(gl, &corners, glow::STATIC_DRAW);
                shared.share(gl, &order)?;
                held.push(HeldSolid { solid: Arc::clone(solid), shared, apart: None });
            }
            let (marks, canvas) = (Held::new(gl)?, Some(Canvas::new(gl)?));
            Ok(Self { plain, xray, solids: held, piece_lightness, marks, canvas, renderer, by_processor })
        }
    }

    /// Returns the number of samples in each pixel.
    pub(crate) fn samples(&self) -> i32 {
        self.canvas.as_ref().map_or(1, Canvas::samples)
    }

    /// Returns the solids.
    pub(crate) fn solids(&self) -> Vec<Arc<Solid>> {
        self.solids.iter().map(|held| Arc::clone(&held.solid)).collect()
    }

    /// Returns the number of triangles of all bodies as drawn.
    pub(crate) fn triangles(&self) -> usize {
        self.solids.iter().map(|held| held.solid.triangles.len()).sum()
    }

    /// Draws into the window's `viewport` (left, below, width, height; pixels).
    pub(crate) fn draw(&mut self, gl: &glow::Context, drawing: &Drawing, viewport: [i32; 4]) {
        let Some(mut canvas) = self.canvas.take() else { return };
        // SAFETY: the context is current, as egui's callbacks promise.
        unsafe { canvas.show(gl, viewport, |first| self.draw_from(gl, drawing, first)) };
        self.canvas = Some(canvas);
    }

    /// Draws into the current viewport and scissor rectangle, which begin at pixel `first`.
    fn draw_from(&mut self, gl: &glow::Context, drawing: &Drawing, first: [i32; 2]) {
        // SAFETY: the context is current, as egui's callbacks promise. The objects belong to this
        // context, and buffers are as long as their counts say.
        unsafe {
            gl.disable(glow::BLEND);
            gl.enable(glow::DEPTH_TEST);
            gl.depth_func(glow::LESS);
            gl.depth_mask(true);
            gl.clear_depth_f32(1.0);
            gl.clear(glow::DEPTH_BUFFER_BIT);
            gl.disable(glow::CULL_FACE);
            for body in &drawing.bodies {
                self.apart(gl, body);
            }
            for program in [&self.plain, &self.xray] {
                gl.use_program(Some(program.program));
                matrix(gl, &program.projection, &drawing.projection);
            }
            self.xrays(gl, &drawing.xrays, first);
            let transparent = drawing.bodies.iter().filter(|body| body.xray);
            if transparent.clone().next().is_some() {
                // The nearest depth keeps the rectangle around the probe empty.
                self.within(gl, &drawing.xrays, first, || {
                    gl.clear_depth_f32(0.0);
                    gl.clear(glow::DEPTH_BUFFER_BIT);
                    gl.clear_depth_f32(1.0);
                });
                transparent.clone().for_each(|body| self.body(gl, body, BodyPart::Opaque));
                self.within(gl, &drawing.xrays, first, || {
                    gl.clear(glow::DEPTH_BUFFER_BIT);
                    transparent.for_each(|body| self.body(gl, body, BodyPart::Solid));
                });
            }
            for body in drawing.bodies.iter().filter(|body| !body.is_glass() && !body.xray) {
                self.body(gl, body, BodyPart::Opaque);
            }
            gl.enable(glow::BLEND);
            gl.blend_func(glow::ONE, glow::ONE_MINUS_SRC_ALPHA);
            gl.depth_mask(false);
            gl.enable(glow::CULL_FACE);
            for hidden_side in [glow::FRONT, glow::BACK] {
                gl.cull_face(hidden_side);
                // With software rendering, inner sides of bodies that are transparent only around a
                // probe are left out.
                let is_left_out = |body: &&DrawnBody| self.by_processor && body.xray && hidden_side == glow::FRONT;
                let glass = drawing.bodies.iter().filter(|body| body.glass.is_some());
                for body in glass.filter(|body| !is_left_out(body)) {
                    if body.xray {
                        self.within(gl, &drawing.xrays, first, || self.body(gl, body, BodyPart::Glass));
                    } else {
                        self.body(gl, body, BodyPart::All);
                    }
                }
            }
            gl.use_program(Some(self.plain.program));
            matrix(gl, &self.plain.model_view, &DMat4::IDENTITY);
            gl.uniform_4_f32(self.plain.colour.as_ref(), 0.0, 0.0, 0.0, 0.0);
            gl.uniform_1_f32(self.plain.wire.as_ref(), 0.0);
            gl.uniform_1_i32(self.plain.part.as_ref(), BodyPart::Patch as i32);
            gl.disable(glow::CULL_FACE);
            self.marks.upload(gl, &drawing.patches, glow::STREAM_DRAW);
            self.marks.draw(gl);
            gl.enable(glow::CULL_FACE);
            self.marks.upload(gl, &drawing.marks, glow::STREAM_DRAW);
            gl.uniform_1_i32(self.plain.part.as_ref(), BodyPart::All as i32);
            gl.cull_face(glow::BACK);
            for (test, covered, keeps) in [(glow::GREATER, HIDDEN, false), (glow::LEQUAL, 1.0, true)] {
                gl.depth_func(test);
                gl.depth_mask(keeps);
                gl.uniform_2_f32(self.plain.glass.as_ref(), covered, covered);
                self.marks.draw(gl);
            }
            // egui expects this state.
            gl.depth_mask(true);
            gl.depth_func(glow::LESS);
            gl.disable(glow::DEPTH_TEST);
            gl.disable(glow::CULL_FACE);
        }
    }

    /// Uploads the sides of a body's triangles, if they are shown. Without enough graphics memory,
    /// no sides are drawn.
    ///
    /// # Safety
    ///
    /// The context is current.
    unsafe fn apart(&mut self, gl: &glow::Context, body: &DrawnBody) {
        let lightness = self.piece_lightness;
        let Some(held) = self.solids.get_mut(body.solid).filter(|held| body.wireframe && held.apart.is_none()) else {
            return;
        };
        // SAFETY: the context is current, as the caller promises.
        unsafe {
            if let Ok(mut apart) = Held::new(gl) {
                apart.upload(gl, &apart_corners(&held.solid, lightness), glow::STATIC_DRAW);
                held.apart = Some(apart);
            }
        }
    }

    /// # Safety
    /// The context is current.
    unsafe fn body(&self, gl: &glow::Context, body: &DrawnBody, part: BodyPart) {
        let Some(held) = self.solids.get(body.solid) else { return };
        let colour = linear(body.colour).as_vec3();
        let is_glass = matches!(part, BodyPart::All | BodyPart::Glass);
        let (square, along) = body.glass.filter(|_| is_glass).unwrap_or((1.0, 1.0));
        let program = if matches!(part, BodyPart::Solid | BodyPart::Glass) { &self.xray } else { &self.plain };
        // SAFETY: the context is current, as the caller promises.
        unsafe {
            gl.use_program(Some(program.program));
            matrix(gl, &program.model_view, &body.model_view);
            let own = if body.pieces { 0.0 } else { 1.0 };
            gl.uniform_4_f32(program.colour.as_ref(), colour.x, colour.y, colour.z, own);
            gl.uniform_2_f32(program.glass.as_ref(), square as f32, along as f32);
            gl.uniform_1_f32(program.wire.as_ref(), if body.wireframe { 1.0 } else { 0.0 });
            gl.uniform_1_i32(program.part.as_ref(), part as i32);
            held.apart.as_ref().filter(|_| body.wireframe).unwrap_or(&held.shared).draw(gl);
        }
    }

    /// # Safety
    /// The context is current, and the program for x-rays is in use.
    unsafe fn xrays(&self, gl: &glow::Context, xrays: &[XRay], first: [i32; 2]) {
        let first = DVec3::new(f64::from(first[0]), f64::from(first[1]), 0.0);
        // Unused entries are far from every pixel.
        let (mut ends, mut sizes) = ([-1e6f32; 6 * XRAYS], [0.0; 2 * XRAYS]);
        for (k, xray) in xrays.iter().take(XRAYS).enumerate() {
            for (end, place) in xray.ends.iter().enumerate() {
                ends[6 * k + 3 * end..][..3].copy_from_slice(&(*place + first).as_vec3().to_array());
            }
            sizes[2 * k..][..2].copy_from_slice(&[xray.radius as f32, xray.reach as f32]);
        }
        // SAFETY: the context and the program are ready, as the caller promises.
        unsafe {
            gl.uniform_3_f32_slice(self.xray.ends.as_ref(), &ends);
            gl.uniform_2_f32_slice(self.xray.sizes.as_ref(), &sizes);
        }
    }

    /// Restricts `draw` to the pixels around the probes, because the rest of the body is opaque.
    ///
    /// # Safety
    ///
    /// The context is current.
    unsafe fn within(&self, gl: &glow::Context, xrays: &[XRay], first: [i32; 2], draw: impl FnOnce()) {
        let bounds = xrays.iter().take(XRAYS).map(XRay::bounds);
        let Some([low, high]) = bounds.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]) else { return };
        let whole = [low.floor(), high.ceil()].map(|place| [place.x as i32 + first[0], place.y as i32 + first[1]]);
        // SAFETY: the context is current, as the caller promises.
        unsafe {
            let (is_bounded, mut before) = (gl.is_enabled(glow::SCISSOR_TEST), [0; 4]);
            gl.get_parameter_i32_slice(glow::SCISSOR_BOX, &mut before);
            let [mut low, mut high] = whole;
            if is_bounded {
                for axis in 0..2 {
                    low[axis] = low[axis].max(before[axis]);
                    high[axis] = high[axis].min(before[axis] + before[axis + 2]);
                }
            }
            gl.enable(glow::SCISSOR_TEST);
            gl.scissor(low[0], low[1], (high[0] - low[0]).max(0), (high[1] - low[1]).max(0));
            draw();
            gl.scissor(before[0], before[1], before[2], before[3]);
            if !is_bounded {
                gl.disable(glow::SCISSOR_TEST);
            }
        }
    }

    /// Releases all objects of the graphics library.
    pub(crate) fn destroy(&self, gl: &glow::Context) {
        // SAFETY: the context is current, as egui's callbacks promise, and nothing is drawn any
        // more.
        unsafe {
            [&self.plain, &self.xray].into_iter().for_each(|program| gl.delete_program(program.program));
            if let Some(canvas) = &self.canvas {
                canvas.destroy(gl);
            }
            let solids = self.solids.iter().flat_map(|solid| [Some(&solid.shared), solid.apart.as_ref()]).flatten();
            for held in solids.chain([&self.marks]) {
                gl.delete_vertex_array(held.array);
                gl.delete_buffer(held.buffer);
                held.order.into_iter().for_each(|order| gl.delete_buffer(order));
            }
        }
    }
}

impl Program {
    /// # Errors
    /// Fails with the message of the graphics library.
    ///
    /// # Safety
    /// The context is current.
    unsafe fn new(gl: &glow::Context, by_processor: bool, with_xrays: bool) -> Result<Self, String> {
        // SAFETY: the context is current, as the caller promises.
        unsafe {
            let program = program(gl, by_processor, with_xrays)?;
            let uniform = |name| gl.get_uniform_location(program, name);
            Ok(Self {
                program,
                projection: uniform("u_projection"),
                model_view: uniform("u_model_view"),
                colour: uniform("u_colour"),
                glass: uniform("u_glass"),
                wire: uniform("u_wire"),
                ends: uniform("u_ends"),
                sizes: uniform("u_sizes"),
                part: uniform("u_part"),
            })
        }
    }
}

/// # Safety
/// The context is current, and the program is in use.
unsafe fn matrix(gl: &glow::Context, at: &Option<glow::UniformLocation>, matrix: &DMat4) {
    // SAFETY: the context and the program are ready, as the caller promises.
    unsafe { gl.uniform_matrix_4_f32_slice(at.as_ref(), false, &matrix.as_mat4().to_cols_array()) };
}

impl Held {
    /// # Safety
    /// The context is current.
    unsafe fn new(gl: &glow::Context) -> Result<Self, String> {
        // SAFETY: the context is current, as the caller promises; the pointers lie within a corner.
        unsafe {
            let array = gl.create_vertex_array()?;
            let buffer = gl.create_buffer()?;
            gl.bind_vertex_array(Some(array));
            gl.bind_buffer(glow::ARRAY_BUFFER, Some(buffer));
            let real = size_of::<f32>() as i32;
            for slot in 0..4 {
                gl.enable_vertex_attrib_array(slot);
                gl.vertex_attrib_pointer_f32(slot, 3, glow::FLOAT, false, CORNER as i32 * real, slot as i32 * 3 * real);
            }
            gl.bind_vertex_array(None);
            Ok(Self { array, buffer, order: None, count: 0 })
        }
    }

    /// # Safety
    /// The context is current.
    unsafe fn upload(&mut self, gl: &glow::Context, corners: &[f32], usage: u32) {
        let bytes: Vec<u8> = corners.iter().flat_map(|part| part.to_ne_bytes()).collect();
        // SAFETY: the context is current, as the caller promises.
        unsafe {
            gl.bind_buffer(glow::ARRAY_BUFFER, Some(self.buffer));
            gl.buffer_data_u8_slice(glow::ARRAY_BUFFER, &bytes, usage);
            gl.bind_buffer(glow::ARRAY_BUFFER, None);
        }
        self.count = (corners.len() / CORNER) as i32;
    }

    /// Sets the corner indices of the triangles to `order`.
    ///
    /// # Safety
    ///
    /// The context is current.
    unsafe fn share(&mut self, gl: &glow::Context, order: &[u32]) -> Result<(), String> {
        let bytes: Vec<u8> = order.iter().flat_map(|number| number.to_ne_bytes()).collect();
        // SAFETY: the context is current, as the caller promises; the indices are of uploaded
        // corners.
        unsafe {
            let buffer = gl.create_buffer()?;
            gl.bind_vertex_array(Some(self.array));
            gl.bind_buffer(glow::ELEMENT_ARRAY_BUFFER, Some(buffer));
            gl.buffer_data_u8_slice(glow::ELEMENT_ARRAY_BUFFER, &bytes, glow::STATIC_DRAW);
            gl.bind_vertex_array(None);
            self.order = Some(buffer);
        }
        self.count = order.len() as i32;
        Ok(())
    }

    /// # Safety
    /// The context is current, and a program is in use.
    unsafe fn draw(&self, gl: &glow::Context) {
        // SAFETY: the context and the program are ready, as the caller promises.
        unsafe {
            gl.bind_vertex_array(Some(self.array));
            match self.order {
                Some(_) => gl.draw_elements(glow::TRIANGLES, self.count, glow::UNSIGNED_INT, 0),
                None => gl.draw_arrays(glow::TRIANGLES, 0, self.count),
            }
            gl.bind_vertex_array(None);
        }
    }
}
