//! A world: tools, objects, and the wrench of each step.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use palpus::{BodyId, NoClock, Object, ProbeState, SettingsError, ToolId, Twist};
use pyo3::prelude::*;

use crate::arrays::{of_pair, of_pose, pose, poses, twist, twists, vector};
use crate::bodies::Body;
use crate::refused::{failed, refused};
use crate::rows::ContactRow;
use crate::settings::Settings;

/// Tools, which follow devices, and objects, which are fixed, driven by the host, or free.
///
/// Lengths are metres. A pose is (tx, ty, tz, qx, qy, qz, qw). A twist is (vx, vy, vz, wx, wy, wz)
/// in m/s and rad/s. A wrench is (fx, fy, fz, tx, ty, tz) in N and N·m. Vectors are in the world's
/// axes. Bodies are numbered from 0 in the order in which they were added.
#[pyclass(module = "palpus")]
pub(crate) struct World {
    /// `None` while a loop runs the world.
    world: Option<palpus::World>,
    members: Vec<Member>,
    probes: Vec<ProbeState>,
}

/// A body of the world.
struct Member {
    body: BodyId,
    tool: Option<ToolId>,
    is_driven: bool,
}

#[pymethods]
impl World {
    /// Creates an empty world. `settings` applies to contacts between objects; each tool has its
    /// own settings.
    #[new]
    #[pyo3(signature = (settings, *, gravity=None))]
    fn new(settings: &Bound<'_, Settings>, gravity: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let mut world = palpus::World::new(settings.get().settings).map_err(|error| failed(&error))?;
        if let Some(gravity) = gravity {
            world.set_gravity(vector("gravity", gravity)?);
        }
        Ok(Self { world: Some(world), members: Vec::new(), probes: Vec::new() })
    }

    /// Adds a body that never moves, and returns its number.
    fn add_fixed(&mut self, body: &Bound<'_, Body>, pose: &Bound<'_, PyAny>) -> PyResult<usize> {
        self.add(Object::fixed(body.get().shared().clone(), self::pose("pose", pose)?), false)
    }

    /// Adds a body that the host moves with `drive`, and returns its number.
    fn add_driven(&mut self, body: &Bound<'_, Body>, pose: &Bound<'_, PyAny>) -> PyResult<usize> {
        self.add(Object::driven(body.get().shared().clone(), self::pose("pose", pose)?), true)
    }

    /// Adds a body that moves under contact, friction and gravity, and returns its number. Give
    /// either its `density` (kg/m³) or its `mass` (kg).
    #[pyo3(signature = (body, pose, *, density=None, mass=None))]
    fn add_free(
        &mut self,
        body: &Bound<'_, Body>,
        pose: &Bound<'_, PyAny>,
        density: Option<f64>,
        mass: Option<f64>,
    ) -> PyResult<usize> {
        let (body, pose) = (body.get().shared().clone(), self::pose("pose", pose)?);
        match (density, mass) {
            (Some(density), None) => self.add(Object::free(body, pose, density), false),
            (None, Some(mass)) => self.add(Object::free_of_mass(body, pose, mass), false),
            _ => Err(refused("a free body must have either a density or a mass")),
        }
    }

    /// Adds a tool, and returns its number. The pose of the tool is the next row of the poses of
    /// `step`.
    fn add_tool(&mut self, body: &Bound<'_, Body>, settings: &Bound<'_, Settings>) -> PyResult<usize> {
        let added = self.inner_mut()?.add_tool(body.get().shared().clone(), settings.get().settings);
        let tool = added.map_err(|error| failed(&error))?;
        self.members.push(Member { body: self.inner()?.body_of(tool), tool: Some(tool), is_driven: false });
        self.probes.push(ProbeState::at(palpus::Pose::IDENTITY));
        Ok(self.members.len() - 1)
    }

    /// Makes a step of `dt` seconds. Returns the wrench of each tool (tools, 6), about its grip.
    ///
    /// `poses` (tools, 7) are the poses of the tools' frames in the world, in the order in which
    /// the tools were added. `twists` (tools, 6) are the twists of the grips; the default is zero.
    /// With a single tool, the first dimension may be omitted.
    #[pyo3(signature = (poses, dt=1e-3, *, twists=None))]
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
        dt: f64,
        twists: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let count = self.probes.len();
        let expect = |name: &str, given: usize| match given == count {
            true => Ok(()),
            false => Err(refused(format!("{name} has {given} rows, but the world has {count} tools"))),
        };
        if !(dt.is_finite() && dt > 0.0) {
            return Err(refused(format!("dt is {dt}, but must be a time in seconds greater than 0")));
        }
        let poses = self::poses("poses", poses)?;
        expect("poses", poses.len())?;
        let given = twists.map_or(Ok(Vec::new()), |given| self::twists("twists", given))?;
        if twists.is_some() {
            expect("twists", given.len())?;
        }
        for (k, (probe, pose_ba)) in self.probes.iter_mut().zip(poses).enumerate() {
            *probe = ProbeState { pose_ba, twist: given.get(k).copied().unwrap_or_default() };
        }
        let (world, probes) = (self.world.as_mut().ok_or_else(lent)?, &self.probes);
        py.detach(|| world.step(probes, dt, &NoClock));
        let mut wrenches = Vec::with_capacity(6 * count);
        for tool in self.members.iter().filter_map(|member| member.tool) {
            let commanded = &self.inner()?.tick(tool).commanded;
            wrenches.extend(of_pair(commanded.force, commanded.torque));
        }
        wrenches.into_pyarray(py).reshape([count, 6])
    }

    /// Returns the wrench of a tool in the last step (6,), about the grip, within its limits.
    fn wrench<'py>(&self, py: Python<'py>, tool: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let member = self.member(tool)?;
        let Some(id) = member.tool else {
            return Err(refused(format!("body {tool} is an object; only tools have a wrench")));
        };
        let commanded = &self.inner()?.tick(id).commanded;
        Ok(row(py, of_pair(commanded.force, commanded.torque)))
    }

    /// Returns the contacts of two bodies in the last step, in the world's frame: an array of
    /// CONTACT. In each row, a is the first body.
    fn contacts<'py>(&self, py: Python<'py>, of: usize, other: usize) -> PyResult<Bound<'py, PyArray1<ContactRow>>> {
        let (of, with) = (self.member(of)?.body, self.member(other)?.body);
        let rows: Vec<ContactRow> =
            self.inner()?.contacts(of, with).map(|contact| ContactRow::new(0, &contact)).collect();
        Ok(rows.into_pyarray(py))
    }

    /// Sets the pose and the velocity of a driven body. You can call this function at any rate;
    /// between two calls the body continues at this velocity.
    #[pyo3(signature = (body, pose, twist=None))]
    fn drive(&mut self, body: usize, pose: &Bound<'_, PyAny>, twist: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let (id, pose) = (self.member(body)?.body, self::pose("pose", pose)?);
        let twist = self::twist("twist", twist)?;
        let is_driven = self.inner_mut()?.drive(id, pose, twist);
        if is_driven { Ok(()) } else { Err(refused(format!("body {body} is not driven"))) }
    }

    /// Moves an object to `pose`, at rest.
    fn put(&mut self, body: usize, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        let (id, pose) = (self.member(body)?.body, self::pose("pose", pose)?);
        if self.inner_mut()?.put(id, pose) {
            Ok(())
        } else {
            Err(refused(format!("body {body} is a tool; its device moves it")))
        }
    }

    /// Gives a free body a velocity (of its centre of mass).
    fn throw(&mut self, body: usize, twist: &Bound<'_, PyAny>) -> PyResult<()> {
        let (id, twist) = (self.member(body)?.body, self::twist("twist", Some(twist))?);
        if self.inner_mut()?.throw(id, twist) { Ok(()) } else { Err(refused(format!("body {body} is not free"))) }
    }

    /// Returns the pose of a body (7,). For a coupled tool, this pose is the pose of the tool,
    /// not of the device.
    fn pose<'py>(&self, py: Python<'py>, body: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(row(py, of_pose(&self.inner()?.pose(self.member(body)?.body))))
    }

    /// Returns the velocity of a body (6,), at its centre of mass.
    fn twist<'py>(&self, py: Python<'py>, body: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let Twist { linear, angular } = self.inner()?.twist(self.member(body)?.body);
        Ok(row(py, of_pair(linear, angular)))
    }

    /// Discards contacts and friction, so that the next step is like a first step. Objects keep
    /// their poses.
    fn clear(&mut self) -> PyResult<()> {
        self.inner_mut()?.clear();
        Ok(())
    }

    fn __repr__(&self) -> String {
        format!("<palpus.World: {} bodies, {} of them tools>", self.members.len(), self.probes.len())
    }
}

impl World {
    fn add(&mut self, object: Object, is_driven: bool) -> PyResult<usize> {
        let body = self.inner_mut()?.add(object).map_err(|error: SettingsError| failed(&error))?;
        self.members.push(Member { body, tool: None, is_driven });
        Ok(self.members.len() - 1)
    }

    fn inner(&self) -> PyResult<&palpus::World> {
        self.world.as_ref().ok_or_else(lent)
    }

    fn inner_mut(&mut self) -> PyResult<&mut palpus::World> {
        self.world.as_mut().ok_or_else(lent)
    }

    /// Passes the world and its tool to a loop. Fails if there is not exactly one tool.
    pub(crate) fn lend(&mut self) -> PyResult<(palpus::World, ToolId)> {
        let tools: Vec<ToolId> = self.members.iter().filter_map(|member| member.tool).collect();
        let [tool] = tools[..] else {
            return Err(refused(format!("the world has {} tools, but a loop needs exactly one", tools.len())));
        };
        Ok((self.world.take().ok_or_else(lent)?, tool))
    }

    /// Takes the world back from a loop.
    pub(crate) fn give_back(&mut self, world: palpus::World) {
        self.world = Some(world);
    }

    /// Returns the settings of the only tool.
    pub(crate) fn tool_settings(&self) -> PyResult<palpus::Settings> {
        let world = self.inner()?;
        let tool = self.members.iter().find_map(|member| member.tool);
        let tool = tool.ok_or_else(|| refused("the world has no tool; add one before the loop starts"))?;
        Ok(*world.tool_settings(tool))
    }

    /// Returns the driven body with this number. Fails if there is no such body or it is not
    /// driven.
    pub(crate) fn driven(&self, number: usize) -> PyResult<BodyId> {
        let member = self.member(number)?;
        if member.is_driven { Ok(member.body) } else { Err(refused(format!("body {number} is not driven"))) }
    }

    fn member(&self, number: usize) -> PyResult<&Member> {
        let count = self.members.len();
        let unknown = || refused(format!("there is no body {number}; the world has {count} bodies, counted from 0"));
        self.members.get(number).ok_or_else(unknown)
    }
}

fn lent() -> PyErr {
    refused("a loop is running this world; use the loop's status, or stop the loop")
}

pub(crate) fn row<const N: usize>(py: Python<'_>, numbers: [f64; N]) -> Bound<'_, PyArray1<f64>> {
    numbers.to_vec().into_pyarray(py)
}
