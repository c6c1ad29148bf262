//! Two tools over a fixed environment, for the tests.

use super::*;

/// Two tools and a fixed environment. The environment's frame is the world's frame.
pub(super) struct Two {
    pub(super) world: World,
    pub(super) tools: [ToolId; 2],
}

impl Two {
    pub(super) fn new(
        probes: [Arc<Body>; 2],
        environment: Arc<Body>,
        settings: [Settings; 2],
    ) -> Result<Self, SettingsError> {
        let mut world = World::new(settings[0])?;
        world.add(Object::fixed(environment, Pose::IDENTITY))?;
        let [one, other] = probes;
        let tools = [world.add_tool(one, settings[0])?, world.add_tool(other, settings[1])?];
        Ok(Self { world, tools })
    }

    pub(super) fn step(&mut self, probes: &[ProbeState; 2], dt: f64, clock: &NoClock) -> [&Tick; 2] {
        self.world.step(probes, dt, clock);
        self.ticks()
    }

    pub(super) fn ticks(&self) -> [&Tick; 2] {
        self.tools.map(|tool| self.world.tick(tool))
    }

    pub(super) fn set_settings(&mut self, tool: usize, settings: &Settings) -> Result<(), SettingsError> {
        self.world.set_tool_settings(self.tools[tool], settings)
    }

    pub(super) fn settings(&self) -> [&Settings; 2] {
        self.tools.map(|tool| self.world.tool_settings(tool))
    }

    pub(super) fn settings_between(&self) -> &Settings {
        let [one, other] = self.tools.map(|tool| self.world.body_of(tool));
        self.world.settings_between(one, other).expect("the pair of tools has settings")
    }
}

pub(super) fn add_box(soup: &mut PolygonSoup, low: DVec3, high: DVec3) {
    let base = soup.vertices.len() as u32;
    soup.vertices
        .extend((0..8u32).map(|k| DVec3::select(glam::BVec3::new(k & 1 != 0, k & 2 != 0, k & 4 != 0), high, low)));
    for face in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        soup.push_face(&face.map(|k| base + k));
    }
}

pub(super) fn boxes(list: &[(DVec3, DVec3)], at: &Pose) -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    for (low, high) in list {
        add_box(&mut soup, *low, *high);
    }
    for vertex in &mut soup.vertices {
        *vertex = at.point(*vertex);
    }
    let (mesh, _) = Mesh::from_soup(&soup).unwrap();
    Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap())
}

pub(super) fn block() -> Arc<Body> {
    boxes(&[(-HALF, HALF)], &Pose::IDENTITY)
}

/// A floor whose top is z = 0.
pub(super) const FLOOR: (DVec3, DVec3) = (DVec3::new(-0.2, -0.2, -0.05), DVec3::new(0.2, 0.2, 0.0));

pub(super) fn direct() -> Settings {
    Settings { limits: Limits { force: f64::INFINITY, torque: f64::INFINITY }, ..Settings::default() }
}

pub(super) fn coupled() -> Settings {
    let settings = Settings::default();
    Settings {
        limits: LIMITS,
        stiffness: VirtualCoupling::contact_stiffness(&LIMITS, settings.contact_tolerance).unwrap(),
        coupling: Some(VirtualCoupling::tuned(&LIMITS, DT, settings.contact_tolerance)),
        ..settings
    }
}

/// Returns two blocks over a floor.
pub(super) fn blocks(change: impl Fn(&mut Settings), coupling: bool) -> Two {
    let block = block();
    let mut settings = if coupling { coupled() } else { direct() };
    change(&mut settings);
    Two::new([block.clone(), block], boxes(&[FLOOR], &Pose::IDENTITY), [settings; 2]).unwrap()
}

pub(super) fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::from_translation(DVec3::new(x, y, z))
}

pub(super) fn still(pose: Pose) -> ProbeState {
    ProbeState::at(pose)
}

/// Returns the magnitudes of the sum of both tools' mutual wrenches, about the first tool's
/// centre of mass: force (N) and torque (N·m).
pub(super) fn imbalance(ticks: [&Tick; 2]) -> (f64, f64) {
    let [first, second] = ticks;
    // The blocks' centres of mass are their frames' origins.
    let apart = first.tool_ba.translation - second.tool_ba.translation;
    let sum = first.from_other + second.from_other.about(apart);
    (sum.force.length(), sum.torque.length())
}

pub(super) fn wandering(random: &mut Random, pose: &mut Pose) -> ProbeState {
    *pose = Pose::new(DQuat::from_scaled_axis(random.point(0.01)), random.point(4e-4)) * *pose;
    ProbeState { pose_ba: *pose, twist: Twist { angular: random.point(0.5), linear: random.point(0.1) } }
}
