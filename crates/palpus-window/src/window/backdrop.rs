//! The background of a scene: lighter above than below, as in pictures.
//!
//! The background fills most of the window. egui would draw each pixel through a texture, which
//! takes half of a frame with software rendering, so the background has its own simple shader.
#![allow(unsafe_code)] // As in `gl`.

use eframe::glow::{self, HasContext};

use super::shader::compiled;
use crate::picture::Rgb;

/// Objects of the graphics library.
pub(super) struct Backdrop {
    program: glow::Program,
    array: glow::VertexArray,
    above: Option<glow::UniformLocation>,
    below: Option<glow::UniformLocation>,
}

impl Backdrop {
    /// # Errors
    /// Fails with the message of the graphics library.
    pub(super) fn new(gl: &glow::Context, by_processor: bool) -> Result<Self, String> {
        let before = if by_processor { "" } else { "#define DITHERED\n" };
        // SAFETY: the context is current, as egui's creation of an app promises.
        unsafe {
            let program = compiled(gl, [VERTEX, FRAGMENT], before, &[])?;
            let uniform = |name| gl.get_uniform_location(program, name);
            Ok(Self { program, array: gl.create_vertex_array()?, above: uniform("u_above"), below: uniform("u_below") })
        }
    }

    /// Fills the current viewport and scissor rectangle.
    pub(super) fn draw(&self, gl: &glow::Context, above: Rgb, below: Rgb) {
        // SAFETY: the context is current, as egui's callbacks promise.
        unsafe {
            gl.use_program(Some(self.program));
            gl.disable(glow::BLEND);
            for (at, rgb) in [(&self.above, above), (&self.below, below)] {
                let [r, g, b] = rgb.map(|part| f32::from(part) / 255.0);
                gl.uniform_3_f32(at.as_ref(), r, g, b);
            }
            gl.bind_vertex_array(Some(self.array));
            gl.draw_arrays(glow::TRIANGLES, 0, 3);
            gl.bind_vertex_array(None);
            // egui expects blending.
            gl.enable(glow::BLEND);
        }
    }

    /// Releases all objects of the graphics library.
    pub(super) fn destroy(&self, gl: &glow::Context) {
        // SAFETY: the context is current, as egui's callbacks promise, and nothing is drawn any
        // more.
        unsafe {
            gl.delete_program(self.program);
            gl.delete_vertex_array(self.array);
        }
    }
}

/// A triangle that covers the viewport.
const VERTEX: &str = "
uniform vec3 u_above;
uniform vec3 u_below;
out vec3 v_colour;
void main() {
    vec2 place = vec2(float((gl_VertexID & 1) * 2), float(gl_VertexID & 2));
    v_colour = mix(u_below, u_above, place.y);
    gl_Position = vec4(2.0 * place - 1.0, 0.0, 1.0);
}
";

/// Adds noise of less than a step of a colour, which hides the steps of the gradient. Used
/// only where it is cheap.
const FRAGMENT: &str = "
in vec3 v_colour;
out vec4 f_colour;
void main() {
#ifdef DITHERED
    float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) - 0.5;
    f_colour = vec4(v_colour + noise / 255.0, 1.0);
#else
    f_colour = vec4(v_colour, 1.0);
#endif
}
";
