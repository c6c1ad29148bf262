//! Writes the bodies, poses, wrenches and truths of a case as files, from which other engines
//! process the same poses (`benches/peers/conformal_peers.py`).

use std::io::{BufWriter, Write};
use std::path::Path;

use palpus::algebra::{Pose, Wrench};
use palpus::body::{Body, PolygonSoup};
use palpus_io::write_obj_groups;

use super::cases::Case;
use crate::{files, query};

/// An answer at a pose.
#[derive(Clone, Copy)]
pub(super) struct Answer {
    /// Wrench on a at the origin of its frame.
    pub(super) wrench: Wrench,
    pub(super) contacts: usize,
    /// Separation of the deepest contact, m; infinite without contacts.
    pub(super) separation: f64,
}

/// The file of a case.
pub(super) struct Trace {
    file: BufWriter<Box<dyn Write>>,
}

impl Trace {
    /// Writes the bodies of the case to `folder`, and begins its file.
    pub(super) fn new(folder: &Path, case: &Case) -> anyhow::Result<Self> {
        files::make_folder(folder)?;
        for (name, body) in [("probe", &case.a), ("environment", &case.b)] {
            let file = query::create(&folder.join(format!("{name}.obj")))?;
            write_obj_groups(file, [(name, soup(body))])?;
        }
        let mut file = query::create(&folder.join("trace.csv"))?;
        let answer = |whose: &str| {
            ["contacts", "separation", "force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z"]
                .map(|column| format!("{whose}{column}"))
                .join(",")
        };
        writeln!(file, "tick,tx,ty,tz,qx,qy,qz,qw,step_us,{},{}", answer(""), answer("true_"))?;
        Ok(Self { file })
    }

    /// Writes a row: the pose, the step's time (µs) and answer, and the truth.
    pub(super) fn row(
        &mut self,
        tick: usize,
        pose: &Pose,
        time: f64,
        [found, truth]: [&Answer; 2],
    ) -> anyhow::Result<()> {
        let (t, q) = (pose.translation, pose.rotation);
        let place = [t.x, t.y, t.z, q.x, q.y, q.z, q.w, time].map(|value| format!("{value:?}")).join(",");
        let answer = |one: &Answer| {
            let (f, m) = (one.wrench.force, one.wrench.torque);
            let values = [one.separation, f.x, f.y, f.z, m.x, m.y, m.z].map(|value| format!("{value:?}")).join(",");
            format!("{},{values}", one.contacts)
        };
        writeln!(self.file, "{tick},{place},{},{}", answer(found), answer(truth))?;
        Ok(())
    }

    /// Fails if the last rows could not be written.
    pub(super) fn finish(mut self) -> anyhow::Result<()> {
        Ok(self.file.flush()?)
    }
}

fn soup(body: &Body) -> PolygonSoup {
    let mesh = body.mesh();
    PolygonSoup::from_triangles(mesh.vertices().to_vec(), mesh.triangles())
}

#[cfg(test)]
mod tests {
    use palpus_io::read_mesh_noting;

    use super::super::cases::CASES;
    use super::super::measure::measure;
    use super::*;

    #[test]
    fn traces_have_pairs_of_poses_with_the_truth() {
        let plan = CASES.iter().find(|plan| plan.name == "peg-hole").expect("the case exists");
        let case = Case::of(plan, None, 8).expect("the case can be prepared").expect("the case needs no models");
        let folder = std::env::temp_dir().join(format!("palpus-trace-{}", std::process::id()));
        let mut trace = Trace::new(&folder, &case).expect("the folder can be written");
        measure(&case, 2, 0, Some(&mut trace)).expect("the case can be measured");
        trace.finish().expect("the file can be written");
        let text = std::fs::read_to_string(folder.join("trace.csv")).expect("the file can be read");
        let (head, rows) = text.split_once('\n').expect("the file has a head");
        let names: Vec<&str> = head.split(',').collect();
        let column = |name: &str| names.iter().position(|one| *one == name).expect("the column exists");
        let rows: Vec<Vec<f64>> = rows
            .lines()
            .map(|row| row.split(',').map(|cell| cell.parse().expect("the cell is a number")).collect())
            .collect();
        assert!(rows.iter().all(|row| row.len() == names.len()));
        let ticks: Vec<f64> = rows.iter().map(|row| row[column("tick")]).collect();
        assert_eq!(ticks, [3.0, 4.0, 7.0, 8.0]);
        for row in &rows {
            // The peg is pressed at most 20 µm deep into the wall. Both are faceted.
            for separation in ["separation", "true_separation"] {
                assert!((-2.1e-5..-1e-6).contains(&row[column(separation)]), "{separation}: {row:?}");
            }
            assert!(row[column("contacts")] > 0.0 && row[column("true_force_x")] < 0.0, "{row:?}");
        }
        let soup = read_mesh_noting(&folder.join("probe.obj"), &mut |_| ()).expect("the mesh can be read");
        assert_eq!(soup.vertices, case.a.mesh().vertices());
        std::fs::remove_dir_all(&folder).expect("the folder can be deleted");
    }
}
