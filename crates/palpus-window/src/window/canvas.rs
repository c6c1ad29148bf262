//! The picture into which bodies are drawn before it is copied to the window. The picture has
//! several samples in each pixel, so that edges are smooth.
//!
//! Several samples are cheap on a graphics card and expensive with software rendering. A canvas
//! starts with [`SAMPLES`]. If frames then take longer than [`SLOW`], bodies are drawn into the
//! window with one sample.
#![allow(unsafe_code)] // As in `gl`.

use std::time::{Duration, Instant};

use eframe::glow::{self, HasContext};

use super::shader::compiled;

/// Number of samples in each pixel.
const SAMPLES: i32 = 4;
/// Frame time above which each pixel gets one sample.
const SLOW: Duration = Duration::from_millis(36);
/// Number of frames for which this time is measured.
const FRAMES: u32 = 24;

/// A picture for the graphics library, as large as its part of the window.
pub(super) struct Canvas {
    program: glow::Program,
    array: glow::VertexArray,
    samples: i32,
    target: Option<Target>,
    /// Start of the measured frames, and their number.
    counted: Option<(Instant, u32)>,
}

struct Target {
    size: [i32; 2],
    samples: i32,
    /// Frame buffer with several samples in each pixel.
    drawn: glow::Framebuffer,
    buffers: [glow::Renderbuffer; 2],
    /// Frame buffer with one sample in each pixel.
    resolved: glow::Framebuffer,
    texture: glow::Texture,
}

impl Canvas {
    /// # Errors
    /// Fails with the message of the graphics library.
    ///
    /// # Safety
    /// The context is current.
    pub(super) unsafe fn new(gl: &glow::Context) -> Result<Self, String> {
        // SAFETY: the context is current, as the caller promises.
        unsafe {
            let most = gl.get_parameter_i32(glow::MAX_SAMPLES);
            let program = compiled(gl, [VERTEX, FRAGMENT], "", &[])?;
            let array = gl.create_vertex_array()?;
            Ok(Self { program, array, samples: SAMPLES.min(most), target: None, counted: None })
        }
    }

    /// Returns the number of samples in each pixel.
    pub(super) fn samples(&self) -> i32 {
        self.samples.max(1)
    }

    /// Lets `draw` fill a canvas of `size` pixels, and copies the canvas into the window's
    /// `viewport`. With one sample, or if there is no canvas of this size, `draw` draws into the
    /// window. `draw` gets the position of its first pixel (from the left, from below).
    ///
    /// # Safety
    ///
    /// The context is current.
    pub(super) unsafe fn show(&mut self, gl: &glow::Context, viewport: [i32; 4], draw: impl FnOnce([i32; 2])) {
        self.count();
        let [left, below, width, height] = viewport;
        // SAFETY: the context is current, as the caller promises; all bindings are undone before
        // the end.
        unsafe {
            self.fit(gl, [width, height]);
            let Some(target) = &self.target else { return draw([left, below]) };
            let window = gl.get_parameter_framebuffer(glow::DRAW_FRAMEBUFFER_BINDING);
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(target.drawn));
            gl.viewport(0, 0, width, height);
            gl.disable(glow::SCISSOR_TEST);
            gl.clear_color(0.0, 0.0, 0.0, 0.0);
            gl.clear(glow::COLOR_BUFFER_BIT);
            draw([0, 0]);
            gl.bind_framebuffer(glow::READ_FRAMEBUFFER, Some(target.drawn));
            gl.bind_framebuffer(glow::DRAW_FRAMEBUFFER, Some(target.resolved));
            gl.blit_framebuffer(0, 0, width, height, 0, 0, width, height, glow::COLOR_BUFFER_BIT, glow::NEAREST);
            gl.bind_framebuffer(glow::FRAMEBUFFER, window);
            gl.viewport(left, below, width, height);
            gl.enable(glow::SCISSOR_TEST);
            gl.use_program(Some(self.program));
            gl.active_texture(glow::TEXTURE0);
            gl.bind_texture(glow::TEXTURE_2D, Some(target.texture));
            gl.enable(glow::BLEND);
            gl.blend_func(glow::ONE, glow::ONE_MINUS_SRC_ALPHA);
            gl.bind_vertex_array(Some(self.array));
            gl.draw_arrays(glow::TRIANGLES, 0, 3);
            gl.bind_vertex_array(None);
            gl.bind_texture(glow::TEXTURE_2D, None);
        }
    }

    /// Reduces the samples if frames take too long.
    fn count(&mut self) {
        let now = Instant::now();
        let (since, frames) = self.counted.get_or_insert((now, 0));
        if *frames < FRAMES {
            *frames += 1;
            return;
        }
        if self.samples > 1 && (now - *since) / FRAMES > SLOW {
            self.samples = 1;
        }
        self.counted = Some((now, 0));
    }

    /// # Safety
    /// The context is current.
    unsafe fn fit(&mut self, gl: &glow::Context, size: [i32; 2]) {
        let wanted = (size, self.samples);
        if self.target.as_ref().map(|target| (target.size, target.samples)) == Some(wanted) {
            return;
        }
        // SAFETY: the context is current, as the caller promises.
        unsafe {
            if let Some(target) = self.target.take() {
                target.destroy(gl);
            }
            // If there is no memory for a frame buffer, bodies are drawn into the window.
            self.target = if self.samples > 1 { Target::new(gl, size, self.samples).ok() } else { None };
        }
    }

    /// Releases all objects of the graphics library.
    ///
    /// # Safety
    /// The context is current.
    pub(super) unsafe fn destroy(&self, gl: &glow::Context) {
        // SAFETY: the context is current, as the caller promises.
        unsafe {
            gl.delete_program(self.program);
            gl.delete_vertex_array(self.array);
            if let Some(target) = &self.target {
                target.destroy(gl);
            }
        }
    }
}

impl Target {
    /// # Safety
    /// The context is current.
    unsafe fn new(gl: &glow::Context, size: [i32; 2], samples: i32) -> Result<Self, String> {
        let [width, height] = size;
        // SAFETY: the context is current, as the caller promises.
        unsafe {
            let window = gl.get_parameter_framebuffer(glow::DRAW_FRAMEBUFFER_BINDING);
            let drawn = gl.create_framebuffer()?;
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(drawn));
            let parts = [(glow::RGBA8, glow::COLOR_ATTACHMENT0), (glow::DEPTH_COMPONENT24, glow::DEPTH_ATTACHMENT)];
            let mut buffers = Vec::new();
            for (format, attachment) in parts {
                let buffer = gl.create_renderbuffer()?;
                gl.bind_renderbuffer(glow::RENDERBUFFER, Some(buffer));
                gl.renderbuffer_storage_multisample(glow::RENDERBUFFER, samples, format, width, height);
                gl.framebuffer_renderbuffer(glow::FRAMEBUFFER, attachment, glow::RENDERBUFFER, Some(buffer));
                buffers.push(buffer);
            }
            let complete =
                |gl: &glow::Context| gl.check_framebuffer_status(glow::FRAMEBUFFER) == glow::FRAMEBUFFER_COMPLETE;
            let is_drawn_complete = complete(gl);
            let texture = gl.create_texture()?;
            gl.bind_texture(glow::TEXTURE_2D, Some(texture));
            gl.tex_storage_2d(glow::TEXTURE_2D, 1, glow::RGBA8, width, height);
            for filter in [glow::TEXTURE_MIN_FILTER, glow::TEXTURE_MAG_FILTER] {
                gl.tex_parameter_i32(glow::TEXTURE_2D, filter, glow::NEAREST as i32);
            }
            let resolved = gl.create_framebuffer()?;
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(resolved));
            gl.framebuffer_texture_2d(glow::FRAMEBUFFER, glow::COLOR_ATTACHMENT0, glow::TEXTURE_2D, Some(texture), 0);
            let is_complete = is_drawn_complete && complete(gl);
            gl.bind_framebuffer(glow::FRAMEBUFFER, window);
            gl.bind_texture(glow::TEXTURE_2D, None);
            let target = Self { size, samples, drawn, buffers: [buffers[0], buffers[1]], resolved, texture };
            if is_complete {
                return Ok(target);
            }
            target.destroy(gl);
            Err("no canvas of this size".to_owned())
        }
    }

    /// # Safety
    /// The context is current.
    unsafe fn destroy(&self, gl: &glow::Context) {
        // SAFETY: the context is current, as the caller promises.
        unsafe {
            gl.delete_framebuffer(self.drawn);
            gl.delete_framebuffer(self.resolved);
            self.buffers.iter().for_each(|buffer| gl.delete_renderbuffer(*buffer));
            gl.delete_texture(self.texture);
        }
    }
}

/// A triangle that covers the viewport.
const VERTEX: &str = "
out vec2 v_place;
void main() {
    v_place = vec2(float((gl_VertexID & 1) * 2), float((gl_VertexID & 2)));
    gl_Position = vec4(2.0 * v_place - 1.0, 0.0, 1.0);
}
";

const FRAGMENT: &str = "
uniform sampler2D u_canvas;
in vec2 v_place;
out vec4 f_colour;
void main() {
    f_colour = texture(u_canvas, v_place);
}
";
