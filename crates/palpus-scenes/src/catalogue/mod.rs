//! The built-in scenes by name.

mod block;
pub(crate) mod gut;
mod machine;
mod many;
mod pen_sphere;
pub(crate) use pen_sphere::RADIUS as SPHERE_RADIUS;
mod spoon_cup;
mod torus_torus;
pub(crate) mod trial;
mod two_hands;

use std::f64::consts::PI;

use glam::DVec3;

use crate::flush::Fit;
use crate::scene::{ContactSettings, Friction, Motion, Object, Scene, SecondTool};

/// A built-in scene. Its meshes and its path are built on demand.
#[derive(Clone, Copy, Debug)]
pub struct SceneEntry {
    /// Name of the scene, by which it is selected.
    pub name: &'static str,
    /// Summary in one line, for a list.
    pub summary: &'static str,
    parts: fn() -> Parts,
}

impl SceneEntry {
    /// Builds the scene. The result is the same on every call.
    pub fn build(&self) -> Scene {
        let Parts { probe, environment, contact, path, second, objects } = (self.parts)();
        let falls = objects.iter().any(|object| matches!(object.motion, Motion::Free(_)));
        let gravity = if falls { GRAVITY } else { DVec3::ZERO };
        let second = second.map(|(probe, path)| SecondTool { probe, start: path.pose(0.0), path });
        let start = path.pose(0.0);
        let (name, summary) = (self.name, self.summary);
        Scene { name, summary, probe, environment, contact, start, path, second, objects, gravity }
    }
}

/// The parts of a scene that differ from scene to scene.
struct Parts {
    probe: palpus::body::PolygonSoup,
    environment: palpus::body::PolygonSoup,
    contact: ContactSettings,
    path: crate::HandPath,
    /// Shape of a second tool, and the path of its hand.
    second: Option<(palpus::body::PolygonSoup, crate::HandPath)>,
    /// Objects in addition to the environment.
    objects: Vec<Object>,
}

/// Gravity of scenes with free objects, m/s².
const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

const SCENES: [SceneEntry; 13] = [
    SceneEntry {
        name: "spoon-cup",
        summary: "a spoon stirs in a cup and touches its wall, its floor and its rim (the paper's Figures 4 and 5)",
        parts: spoon_cup::parts,
    },
    SceneEntry {
        name: "pen-sphere",
        summary: "a pen is drawn over a sphere, one contact between convex bodies (the paper's Figure 6)",
        parts: pen_sphere::parts,
    },
    SceneEntry {
        name: "peg-hole",
        summary: "an 8 mm peg finds its hole and goes in with 0.05 mm of clearance",
        parts: block::peg_hole,
    },
    SceneEntry {
        name: "torus-torus",
        summary: "two rings of 2000 triangles linked like a chain, pulled and turned in each other",
        parts: torus_torus::parts,
    },
    SceneEntry {
        name: "intestine",
        summary: "a ball feels its way along the inside of a folded tube of 24 846 triangles",
        parts: gut::parts,
    },
    SceneEntry {
        name: "box-table",
        summary: "a box comes down on its edge, lies flat, slides and tips on a table",
        parts: block::box_table,
    },
    SceneEntry {
        name: "v-groove",
        summary: "a ball drops into a right-angled groove and slides along it on two contacts",
        parts: block::v_groove,
    },
    SceneEntry {
        name: "two-hands",
        summary: "one hand holds a block over a table, the other puts a peg into it; both feel it (two devices)",
        parts: two_hands::parts,
    },
    SceneEntry {
        name: "stack",
        summary: "three free blocks stand on each other; a finger pushes them",
        parts: many::stack,
    },
    SceneEntry {
        name: "drawer-slides",
        summary: "a finger pushes a loose drawer through its frame, straight and askew",
        parts: many::drawer_slides,
    },
    SceneEntry {
        name: "conveyor",
        summary: "a driven turntable carries loose parts round; a finger holds them up",
        parts: many::conveyor,
    },
    SceneEntry {
        name: "tray",
        summary: "a paddle sweeps twenty loose parts about in a tray with thirty pins",
        parts: many::tray,
    },
    SceneEntry {
        name: "nut-table",
        summary: "two fingers take a loose nut from the table and set it on its bolt (two devices)",
        parts: many::nut_table,
    },
];

const TRIALS: [SceneEntry; 15] = [
    SceneEntry { name: "box-tilt", summary: "a box on a table is tilted from side to side", parts: trial::box_tilt },
    SceneEntry {
        name: "box-edge",
        summary: "a box slides flat over the end of a table and back",
        parts: trial::box_edge,
    },
    SceneEntry { name: "box-rest", summary: "a box is put down on a table and rests there", parts: trial::box_rest },
    SceneEntry {
        name: "rails",
        summary: "a knife slides over two ridges that draw together: two contacts become one",
        parts: trial::rails,
    },
    SceneEntry {
        name: "nut-bolt",
        summary: "a nut is wound onto its bolt, pushed and pulled in the thread's play",
        parts: trial::nut_bolt,
    },
    fit_entry(Fit::Slot, || flush(Fit::Slot)),
    fit_entry(Fit::Drawer, || flush(Fit::Drawer)),
    fit_entry(Fit::Key, || flush(Fit::Key)),
    fit_entry(Fit::Peg, || flush(Fit::Peg)),
    SceneEntry {
        name: "box-slide",
        summary: "a box is pressed on a plate with 4 N and slides along it with friction",
        parts: machine::box_slide,
    },
    SceneEntry {
        name: "screwdriver",
        summary: "a screwdriver, held at its handle, is twisted and tilted in a screw's slot",
        parts: machine::screwdriver,
    },
    SceneEntry {
        name: "ball-joint",
        summary: "a ball is pulled against its socket and turned, with 0.1 mm of play",
        parts: machine::ball_joint,
    },
    SceneEntry { name: "gears", summary: "two gears roll on each other, a tooth in each gap", parts: machine::gears },
    SceneEntry {
        name: "rollers",
        summary: "two knurled rollers of 2016 triangles roll on each other",
        parts: machine::rollers,
    },
    SceneEntry {
        name: "rollers-200k",
        summary: "the same rollers with 200 000 triangles each",
        parts: machine::fine_rollers,
    },
];

const fn fit_entry(fit: Fit, parts: fn() -> Parts) -> SceneEntry {
    SceneEntry { name: fit.name(), summary: fit.summary(), parts }
}

/// Returns the parts of the default case of a flush fit.
fn flush(fit: Fit) -> Parts {
    let Scene { probe, environment, contact, path, .. } = fit.usual().scene();
    Parts { probe, environment, contact, path, second: None, objects: Vec::new() }
}

/// Returns the scenes for measurements. Their meshes are not built yet. For scenes that a person
/// can feel, see [`scenes`].
pub fn trials() -> &'static [SceneEntry] {
    &TRIALS
}

/// Returns the built-in scenes that a person can feel. Their meshes are not built yet.
pub fn scenes() -> &'static [SceneEntry] {
    &SCENES
}

/// Builds the scene or trial with this name. `None` if the name is unknown.
pub fn scene(name: &str) -> Option<Scene> {
    scenes().iter().chain(trials()).find(|entry| entry.name == name).map(SceneEntry::build)
}

/// Contact settings of most scenes: stiff and stable at 1 kHz, for bodies of a few centimetres.
const USUAL: ContactSettings = ContactSettings {
    tolerance: 1e-3,
    cluster_radius: 4e-3,
    stiffness: 800.0,
    friction: Some(Friction { static_coefficient: 0.4, dynamic_coefficient: 0.3 }),
    shading: true,
    crease: 40.0 * PI / 180.0,
};

#[cfg(test)]
mod tests;
