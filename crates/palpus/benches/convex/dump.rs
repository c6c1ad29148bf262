//! Writes the shapes and poses as text, for engines in other languages.
//!
//! `SHAPE.a.csv` and `SHAPE.b.csv` have the vertices (x,y,z). `SHAPE.a.faces.csv` and
//! `SHAPE.b.faces.csv` have the triangles of the faces (i,j,k). `SHAPE.MOTION.csv` has the poses of
//! body a in b (stretch,x,y,z,qx,qy,qz,qw). Numbers have enough digits to restore the same bits.
//! Blanks in names become underscores.

use std::fmt::Write;
use std::path::Path;

use palpus::body::Polytope;

use crate::motions::{Case, Motion};
use crate::shapes;

pub(crate) fn write(folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for shape in shapes::all() {
        let name = shape.name.replace(' ', "_");
        for (body, polytope) in [("a", &shape.a), ("b", &shape.b)] {
            std::fs::write(folder.join(format!("{name}.{body}.csv")), vertices(polytope))?;
            std::fs::write(folder.join(format!("{name}.{body}.faces.csv")), triangles(polytope))?;
        }
        for motion in Motion::ALL {
            let file = format!("{name}.{}.csv", motion.name().replace(' ', "_"));
            std::fs::write(folder.join(file), poses(&Case::new(&shape, motion)))?;
        }
    }
    Ok(())
}

fn vertices(polytope: &Polytope) -> String {
    let mut text = String::from("x,y,z\n");
    for v in polytope.vertices() {
        let _ = writeln!(text, "{:?},{:?},{:?}", v.x, v.y, v.z);
    }
    text
}

fn triangles(polytope: &Polytope) -> String {
    let mut text = String::from("i,j,k\n");
    for [i, j, k] in shapes::triangles(polytope) {
        let _ = writeln!(text, "{i},{j},{k}");
    }
    text
}

fn poses(case: &Case) -> String {
    let mut text = String::from("stretch,x,y,z,qx,qy,qz,qw\n");
    for (stretch, poses) in case.stretches.iter().enumerate() {
        for pose in poses {
            let (t, q) = (pose.translation, pose.rotation);
            let _ = writeln!(text, "{stretch},{:?},{:?},{:?},{:?},{:?},{:?},{:?}", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
        }
    }
    text
}
