//! Settings of rendering.

use glam::DVec3;
use palpus::{Limits, Settings as EngineSettings, SettingsError};
use pyo3::prelude::*;

use crate::arrays::vector;
use crate::refused::failed;

/// How contacts feel. Never changes.
#[pyclass(frozen, module = "palpus")]
#[derive(Clone, Copy)]
pub(crate) struct Settings {
    pub(crate) settings: EngineSettings,
}

/// Returns the settings if they are valid.
fn checked(settings: EngineSettings) -> PyResult<Settings> {
    settings.validate().map_err(|error: SettingsError| failed(&error))?;
    Ok(Settings { settings })
}

#[pymethods]
impl Settings {
    /// For a tool on a device that gives `force` (N) and `torque` (N·m) and whose loop turns every
    /// `period` seconds.
    ///
    /// Contacts are looked for within `tolerance` (m; a good one is a hundredth of the smaller
    /// body) and are as hard as the device can show. `friction` is the pair of the static and the
    /// dynamic coefficient. `grip` is where the hand holds the tool (m, in the tool's frame):
    /// wrenches are about that point.
    #[staticmethod]
    #[pyo3(signature = (*, force, torque, tolerance, period=1e-3, friction=None, grip=None))]
    fn coupled(
        force: f64,
        torque: f64,
        tolerance: f64,
        period: f64,
        friction: Option<(f64, f64)>,
        grip: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        Self::of(EngineSettings::coupled(Limits { force, torque }, period, tolerance), friction, grip)
    }

    /// For a tool that is where its device is, without a coupling: each contact pushes with
    /// `stiffness` (N/m) from `tolerance` (m) on, and brakes with `damping` (N·s/m), up to `force`
    /// (N) and `torque` (N·m) together.
    ///
    /// The other arguments are those of `coupled`.
    #[staticmethod]
    #[pyo3(signature = (
        *, tolerance=1e-3, stiffness=800.0, damping=0.0, force=f64::INFINITY, torque=f64::INFINITY, friction=None, grip=None
    ))]
    fn direct(
        tolerance: f64,
        stiffness: f64,
        damping: f64,
        force: f64,
        torque: f64,
        friction: Option<(f64, f64)>,
        grip: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let limits = Limits { force, torque };
        let settings =
            EngineSettings { contact_tolerance: tolerance, stiffness, damping, limits, ..EngineSettings::default() };
        Self::of(settings, friction, grip)
    }

    /// m: contacts are looked for up to this separation.
    #[getter]
    fn tolerance(&self) -> f64 {
        self.settings.contact_tolerance
    }

    /// N/m: how stiff a contact feels.
    #[getter]
    fn stiffness(&self) -> f64 {
        self.settings.stiffness
    }

    /// N·s/m, of the normal motion.
    #[getter]
    fn damping(&self) -> f64 {
        self.settings.damping
    }

    /// N and N·m: the most that a wrench has.
    #[getter]
    fn limits(&self) -> (f64, f64) {
        (self.settings.limits.force, self.settings.limits.torque)
    }

    /// Static and dynamic coefficient, if there is friction.
    #[getter]
    fn friction(&self) -> Option<(f64, f64)> {
        self.settings.friction.map(|friction| (friction.static_coefficient, friction.dynamic_coefficient))
    }

    /// m, in the tool's frame: where the hand holds the tool.
    #[getter]
    fn grip(&self) -> (f64, f64, f64) {
        self.settings.grip_a.into()
    }

    /// Does a coupling tie the tool to the device?
    #[getter]
    fn is_coupled(&self) -> bool {
        self.settings.coupling.is_some()
    }

    fn __repr__(&self) -> String {
        let kind = if self.is_coupled() { "coupled" } else { "direct" };
        let (force, torque) = self.limits();
        format!(
            "<palpus.Settings: {kind}, tolerance {:e} m, {:.0} N/m, at most {force} N and {torque} N·m>",
            self.tolerance(),
            self.stiffness()
        )
    }
}

impl Settings {
    fn of(settings: EngineSettings, friction: Option<(f64, f64)>, grip: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let settings = friction.map_or(settings, |(fixed, sliding)| settings.with_friction(fixed, sliding));
        let grip_a = grip.map_or(Ok(DVec3::ZERO), |grip| vector("grip", grip))?;
        checked(EngineSettings { grip_a, ..settings })
    }
}
