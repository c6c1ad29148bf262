//! `palpus export`: writes a built-in scene as files that a user can edit.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::{Context, anyhow, bail};
use palpus::algebra::{Pose, Twist};
use palpus::body::PolygonSoup;
use palpus_io::write_obj_groups;
use palpus_scenes::{HandPath, Motion, Scene};

use crate::args::ExportArguments;
use crate::hand_path::POSE_PERIOD;
use crate::stage::no_scene;
use crate::{files, output};

/// Files are in millimetres, as most meshes are.
const UNITS_PER_METRE: f64 = 1e3;

pub(crate) fn export(arguments: &ExportArguments) -> anyhow::Result<ExitCode> {
    let scene = palpus_scenes::scene(&arguments.scene).ok_or_else(|| anyhow!("{}", no_scene(&arguments.scene)))?;
    let names = write_scene(&scene, &arguments.folder)?;
    output::line(format!("{}: {}", arguments.folder.display(), names.join(", ")));
    output::line(format!("palpus run {}", arguments.folder.join(SCENE_FILE).display()));
    Ok(ExitCode::SUCCESS)
}

/// Name of the scene file in a folder.
pub(crate) const SCENE_FILE: &str = "scene.toml";

/// Writes the files of a built-in scene into a folder; returns their names.
///
/// # Errors
///
/// Fails if a file cannot be written or exists already.
pub(crate) fn write_scene(scene: &Scene, folder: &Path) -> anyhow::Result<Vec<String>> {
    let problem = || format!("{} could not be created; name another folder", folder.display());
    fs::create_dir_all(folder).with_context(problem)?;
    let named = |name: &str, content| (name.to_owned(), content);
    let mut files = vec![
        named("tool.obj", obj("tool", &scene.probe)?),
        named("part.obj", obj("part", &scene.environment)?),
        named("hand.csv", hand(&scene.path)),
    ];
    if let Some(second) = &scene.second {
        files.push(named("second.obj", obj("second", &second.probe)?));
        files.push(named("second_hand.csv", hand(&second.path)));
    }
    let shapes = shapes(scene);
    for (k, shape) in shapes.iter().enumerate() {
        files.push((shape_file(k), obj("object", shape)?));
    }
    files.push(named(SCENE_FILE, text(scene) + &objects(scene, &shapes)));
    for (name, content) in &files {
        write_new(&folder.join(name), content)?;
    }
    Ok(files.into_iter().map(|(name, _)| name).collect())
}

/// Writes a new file. Fails if the file exists, so that no edited file is lost.
fn write_new(file: &Path, content: &str) -> anyhow::Result<()> {
    if file.exists() {
        bail!("{} exists already; name another folder, or move it away", file.display());
    }
    files::write(file, content)
}

fn obj(name: &str, soup: &PolygonSoup) -> anyhow::Result<String> {
    let mut soup = soup.clone();
    for vertex in &mut soup.vertices {
        *vertex *= UNITS_PER_METRE;
    }
    let mut bytes = Vec::new();
    write_obj_groups(&mut bytes, [(name, soup)])?;
    Ok(String::from_utf8(bytes)?)
}

/// Returns the poses of one pass of the scripted hand.
fn hand(path: &HandPath) -> String {
    let mut text = String::from("tx,ty,tz,qx,qy,qz,qw\n");
    let count = (path.duration() / POSE_PERIOD).ceil() as usize;
    for k in 0..=count {
        let pose = path.pose((k as f64 * POSE_PERIOD).min(path.duration()));
        let ([x, y, z], q) = ((pose.translation * UNITS_PER_METRE).to_array(), pose.rotation);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{x:?},{y:?},{z:?},{:?},{:?},{:?},{:?}", q.x, q.y, q.z, q.w);
    }
    text
}

fn text(scene: &Scene) -> String {
    let contact = &scene.contact;
    let millimetres = |metres: f64| metres * UNITS_PER_METRE;
    let friction = contact.friction.map_or(String::new(), |friction| {
        format!(
            "friction = {{ static = {:?}, dynamic = {:?} }}\n",
            friction.static_coefficient, friction.dynamic_coefficient
        )
    });
    let second = scene.second.as_ref().map_or(String::new(), |second| {
        format!(
            "[second]                    # the tool of another hand, on its own device\nmesh = \"second.obj\"\n{}\n[second.hand]\n\
             preset = \"normal\"\npath = \"second_hand.csv\"\n\n",
            place(&second.start)
        )
    });
    format!(
        "# {}\nunit = \"mm\"\n\n[probe]                     # the tool in the hand, held at the origin of its mesh\nmesh = \"tool.obj\"\n{}\n{second}\
         [environment]               # the part that it touches\nmesh = \"part.obj\"\n\n\
         [contact]\ntolerance = {:?}             # mm: contacts exist below this distance\n{friction}shading = {}\n\n\
         [hand]                      # the simulated hand: without `path` it moves from the start to the part\n\
         preset = \"normal\"           # relaxed, normal, firm, tight, none\npath = \"hand.csv\"\n",
        scene.summary,
        place(&scene.start),
        millimetres(contact.tolerance),
        contact.shading,
    )
}

/// Returns the distinct shapes of the scene's objects.
fn shapes(scene: &Scene) -> Vec<Arc<PolygonSoup>> {
    let mut shapes: Vec<Arc<PolygonSoup>> = Vec::new();
    for object in &scene.objects {
        if !shapes.iter().any(|shape| Arc::ptr_eq(shape, &object.shape)) {
            shapes.push(object.shape.clone());
        }
    }
    shapes
}

fn shape_file(k: usize) -> String {
    format!("object-{}.obj", k + 1)
}

/// Returns the text about the objects.
fn objects(scene: &Scene, shapes: &[Arc<PolygonSoup>]) -> String {
    let mut text = String::new();
    for object in &scene.objects {
        let shape = shapes.iter().position(|shape| Arc::ptr_eq(shape, &object.shape)).unwrap_or_default();
        let motion = match object.motion {
            Motion::Fixed => "motion = \"fixed\"".to_owned(),
            Motion::Free(density) => format!("motion = \"free\"\ndensity = {density:?}            # kg/m³"),
            Motion::Driven(Twist { angular, linear }) => {
                let linear = linear * UNITS_PER_METRE;
                format!(
                    "motion = \"driven\"\nvelocity = [{:?}, {:?}, {:?}]  # mm/s\nangular_velocity = [{:?}, {:?}, {:?}]  # rad/s",
                    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z
                )
            }
        };
        // Writing to a string cannot fail.
        let _ = write!(text, "\n[[object]]\nmesh = \"{}\"\n{}{motion}\n", shape_file(shape), place(&object.start));
    }
    text
}

/// Returns the start pose of a tool, in two lines.
fn place(start: &Pose) -> String {
    let ([x, y, z], q) = ((start.translation * UNITS_PER_METRE).to_array(), start.rotation);
    format!(
        "position = [{x:?}, {y:?}, {z:?}]\norientation = [{:?}, {:?}, {:?}, {:?}]  # quaternion x, y, z, w\n",
        q.x, q.y, q.z, q.w
    )
}
