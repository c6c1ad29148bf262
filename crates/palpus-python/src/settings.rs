//! Settings of haptic rendering.

use glam::DVec3;
use palpus::{Limits, Settings as EngineSettings, SettingsError};
use pyo3::prelude::*;

use crate::arrays::{self, vector};
use crate::bodies::Body;
use crate::refused::failed;

/// Returns a contact tolerance (m) that suits two bodies: the smallest of 1 mm, a hundredth of the
/// smaller body's size, and half of the play of parts that fit into each other.
///
/// `pose` is a pose of a in b's frame. Parts with play must fit into each other there; the search
/// for their play takes up to a second. If more than two bodies can touch each other, take the
/// smallest value of all pairs. The bodies must have a unit.
#[pyfunction]
pub(crate) fn contact_tolerance(
    py: Python<'_>,
    a: &Bound<'_, Body>,
    b: &Bound<'_, Body>,
    pose: &Bound<'_, PyAny>,
) -> PyResult<f64> {
    let (a, b, pose) = (a.get().shared(), b.get().shared(), arrays::pose("pose", pose)?);
    Ok(py.detach(|| palpus::contact_tolerance(a, b, &pose)))
}

/// How contacts are rendered. Settings never change.
#[pyclass(frozen, module = "palpus")]
#[derive(Clone, Copy)]
pub(crate) struct Settings {
    pub(crate) settings: EngineSettings,
}

/// Returns the settings. Fails if the settings are invalid.
fn checked(settings: EngineSettings) -> PyResult<Settings> {
    settings.validate().map_err(|error: SettingsError| failed(&error))?;
    Ok(Settings { settings })
}

#[pymethods]
impl Settings {
    /// Returns settings for a tool that is coupled to a device. `force` (N) and `torque` (N·m) are
    /// the device's limits, and `period` (s) is the period of the loop.
    ///
    /// Contacts are found within `tolerance` (m); `contact_tolerance` returns a value for two
    /// bodies. Contacts are as stiff as the device can render. `friction` is the pair of the static
    /// and the dynamic coefficient. `grip` is the point where the tool is held (m, in the tool's
    /// frame). Wrenches are about that point.
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

    /// Returns settings for a tool that is at its device's pose, without a coupling. Each contact
    /// pushes with `stiffness` (N/m) below the separation `tolerance` (m), and brakes with
    /// `damping` (N·s/m). All contacts together give at most `force` (N) and `torque` (N·m).
    ///
    /// The other arguments are the same as for `coupled`.
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

    /// Contacts are found up to this separation, m.
    #[getter]
    fn tolerance(&self) -> f64 {
        self.settings.contact_tolerance
    }

    /// Stiffness of a contact, N/m.
    #[getter]
    fn stiffness(&self) -> f64 {
        self.settings.stiffness
    }

    /// Damping of the normal motion, N·s/m.
    #[getter]
    fn damping(&self) -> f64 {
        self.settings.damping
    }

    /// Maximum force (N) and torque (N·m).
    #[getter]
    fn limits(&self) -> (f64, f64) {
        (self.settings.limits.force, self.settings.limits.torque)
    }

    /// Static and dynamic friction coefficient. None if there is no friction.
    #[getter]
    fn friction(&self) -> Option<(f64, f64)> {
        self.settings.friction.map(|friction| (friction.static_coefficient, friction.dynamic_coefficient))
    }

    /// Point where the tool is held, m, in the tool's frame.
    #[getter]
    fn grip(&self) -> (f64, f64, f64) {
        self.settings.grip_a.into()
    }

    /// True if a coupling connects the tool to the device.
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
