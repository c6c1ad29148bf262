//! The shader programs for corners and pixels.
#![allow(unsafe_code)] // As in `gl`.

use eframe::egui_glow::ShaderVersion;
use eframe::glow::{self, HasContext};

/// Creates a program that draws bodies and marks. If `by_processor`, light is computed for corners.
/// `with_xrays`: the program can leave out pixels, which is needed around a probe. Without that, a
/// software renderer computes no light for hidden pixels.
///
/// # Errors
///
/// Fails with the message of the graphics library.
///
/// # Safety
///
/// The context is current.
pub(super) unsafe fn program(
    gl: &glow::Context,
    by_processor: bool,
    with_xrays: bool,
) -> Result<glow::Program, String> {
    let per_corner = if by_processor { PER_CORNER } else { "" };
    let xrays = if with_xrays { format!("#define XRAYS {XRAYS}\n") } else { String::new() };
    let before = format!("{xrays}{per_corner}{LIT}");
    // SAFETY: the context is current, as the caller promises.
    unsafe { compiled(gl, [VERTEX, FRAGMENT], &before, &["a_point", "a_normal", "a_colour", "a_sides"]) }
}

/// Compiles and links a vertex and a fragment shader. `before` is put before both sources;
/// `attributes` are numbered in order.
///
/// # Errors
///
/// Fails with the message of the graphics library.
///
/// # Safety
///
/// The context is current.
pub(super) unsafe fn compiled(
    gl: &glow::Context,
    sources: [&str; 2],
    before: &str,
    attributes: &[&str],
) -> Result<glow::Program, String> {
    let version = ShaderVersion::get(gl);
    if !version.is_new_shader_interface() {
        return Err("OpenGL 3.0 or OpenGL ES 3.0 is needed".to_owned());
    }
    // SAFETY: the context is current, as the caller promises.
    unsafe {
        let program = gl.create_program()?;
        for (slot, name) in attributes.iter().enumerate() {
            gl.bind_attrib_location(program, slot as u32, name);
        }
        let mut shaders = Vec::new();
        for (kind, source) in [glow::VERTEX_SHADER, glow::FRAGMENT_SHADER].into_iter().zip(sources) {
            let shader = gl.create_shader(kind)?;
            gl.shader_source(shader, &format!("{}\n{PRECISION}{before}{source}", version.version_declaration()));
            gl.compile_shader(shader);
            if !gl.get_shader_compile_status(shader) {
                return Err(gl.get_shader_info_log(shader));
            }
            gl.attach_shader(program, shader);
            shaders.push(shader);
        }
        gl.link_program(program);
        if !gl.get_program_link_status(program) {
            return Err(gl.get_program_info_log(program));
        }
        for shader in shaders {
            gl.detach_shader(program, shader);
            gl.delete_shader(shader);
        }
        Ok(program)
    }
}

const PRECISION: &str = "#ifdef GL_ES\nprecision highp float;\nprecision highp int;\n#endif\n";

/// Largest number of capsules around which a body is transparent: the probes of two hands.
pub(super) const XRAYS: usize = 2;

/// For software renderers: light is computed for corners, not for all pixels of small triangles.
const PER_CORNER: &str = "#define PER_CORNER\n";

/// Light and opacity at a position, for both shaders.
const LIT: &str = "
uniform vec4 u_colour;
uniform vec2 u_glass;
vec4 lit(vec3 point, vec3 normal, vec3 colour) {
    vec3 n = normalize(normal);
    vec3 eye = normalize(-point);
    if (dot(n, eye) < 0.0) { n = -n; }
    vec3 key = vec3(-0.45, 0.62, 0.64);
    vec3 fill = vec3(0.80, 0.05, 0.60);
    float slant = 1.0 - clamp(dot(n, eye), 0.0, 1.0);
    vec3 light = vec3(0.27, 0.285, 0.31) + vec3(0.15, 0.16, 0.18) * n.y;
    light += vec3(0.70, 0.68, 0.64) * max(dot(n, key), 0.0) + vec3(0.22, 0.24, 0.27) * max(dot(n, fill), 0.0);
    vec3 own = mix(colour, u_colour.rgb, u_colour.a);
    float gloss = pow(max(dot(n, normalize(key + eye)), 0.0), 48.0);
    float rim = slant * slant * slant;
    return vec4(own * light + vec3(0.15 * gloss) + vec3(0.06, 0.065, 0.07) * rim, mix(u_glass.x, u_glass.y, slant * slant));
}
";

const VERTEX: &str = "
uniform mat4 u_projection;
uniform mat4 u_model_view;
in vec3 a_point;
in vec3 a_normal;
in vec3 a_colour;
in vec3 a_sides;
out vec3 v_sides;
#ifdef PER_CORNER
out vec4 v_lit;
#else
out vec3 v_point;
out vec3 v_normal;
out vec3 v_colour;
#endif
void main() {
    vec4 point = u_model_view * vec4(a_point, 1.0);
    vec3 normal = mat3(u_model_view) * a_normal;
#ifdef PER_CORNER
    v_lit = lit(point.xyz, normal, a_colour);
    v_lit.rgb = sqrt(clamp(v_lit.rgb, 0.0, 1.0));
#else
    v_point = point.xyz;
    v_normal = normal;
    v_colour = a_colour;
#endif
    v_sides = a_sides;
    gl_Position = u_projection * point;
}
";

const FRAGMENT: &str = "
uniform float u_wire;
// The pass: a whole body, its opaque part, its translucent part, or a patch.
uniform int u_part;
#ifdef XRAYS
// Capsules around which bodies are transparent: ends (pixels, and m from the camera), radius
// (pixels) and reach (m).
uniform vec3 u_ends[2 * XRAYS];
uniform vec2 u_sizes[XRAYS];
#endif
in vec3 v_sides;
#ifdef PER_CORNER
in vec4 v_lit;
#else
in vec3 v_point;
in vec3 v_normal;
in vec3 v_colour;
#endif
out vec4 f_colour;
#ifdef XRAYS
// Equals `XRay::solidity`.
float solidity(vec3 one, vec3 other, vec2 sizes) {
    vec2 along = other.xy - one.xy;
    float part = clamp(dot(gl_FragCoord.xy - one.xy, along) / max(dot(along, along), 1e-6), 0.0, 1.0);
    vec3 nearest = mix(one, other, part);
    float beside = smoothstep(sizes.x, 1.45 * sizes.x, length(gl_FragCoord.xy - nearest.xy));
    float behind = smoothstep(nearest.z - 0.2 * sizes.y, nearest.z + 2.0 * sizes.y, 1.0 / gl_FragCoord.w);
    return max(beside, behind);
}
#endif
void main() {
#ifdef PER_CORNER
    vec4 seen = v_lit;
#else
    vec4 seen = lit(v_point, v_normal, v_colour);
    seen.rgb = sqrt(clamp(seen.rgb, 0.0, 1.0));
#endif
#ifdef XRAYS
    float solid = 1.0;
    for (int k = 0; k < XRAYS; k++) {
        solid = min(solid, solidity(u_ends[2 * k], u_ends[2 * k + 1], u_sizes[k]));
    }
    if ((solid < 1.0) == (u_part == 1)) { discard; }
    seen.a = mix(seen.a, 1.0, solid);
    if (u_part == 1) { seen.a = 1.0; }
#else
    if (u_part == 3) { seen.a = v_sides.x; }
#endif
    if (u_wire > 0.5) {
        vec3 sides = v_sides / max(fwidth(v_sides), vec3(1e-6));
        if (min(sides.x, min(sides.y, sides.z)) < 0.8) {
            seen.rgb = mix(seen.rgb, vec3(0.14), 0.55);
            seen.a = max(seen.a, 0.55);
        }
    }
    f_colour = vec4(seen.rgb * seen.a, seen.a);
}
";
