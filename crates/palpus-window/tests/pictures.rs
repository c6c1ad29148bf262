//! Tests that pictures show the scene at the right places, and are reproducible.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Alone, NoClock, Pose};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::render::{ProbeState, Renderer, Settings};
use palpus_window::{
    Axis, BodyPart, Camera, Look, Moment, Picture, PieceOf, Scene, Section, SectionOf, SectionPlane, Shown, ShownBody,
    Solid, Style, Theme, Unit, View, before_surface_faces, depth_colour, paint, paint_gauss, paint_gauss_half,
    paint_section, paint_section_panel,
};

const WIDTH: usize = 320;
const HEIGHT: usize = 200;

fn cuboid(half: DVec3) -> Arc<Body> {
    let side = |k: usize, bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let points: Vec<DVec3> = (0..8).map(|k| half * DVec3::new(side(k, 0), side(k, 1), side(k, 2))).collect();
    Arc::new(Body::from_convex(&points).expect("the box has a hull"))
}

/// Returns a box that leans on a table with one edge, `height` metres above contact.
fn leaning(height: f64) -> Scene {
    let (probe, table) = (cuboid(DVec3::new(0.02, 0.015, 0.01)), cuboid(DVec3::new(0.05, 0.04, 0.01)));
    let settings = Settings { patch_angle: None, ..Settings::default() };
    let mut renderer = Renderer::new(probe.clone(), table.clone(), settings).expect("the settings are valid");
    let rotation = DQuat::from_rotation_y(0.5);
    let lowest = probe.mesh().vertices().iter().map(|v| (rotation * *v).z).fold(f64::INFINITY, f64::min);
    let pose = Pose::new(rotation, DVec3::new(0.0, 0.0, 0.01 - lowest + height));
    let tick = renderer.step(&ProbeState::at(pose), 1e-3, &NoClock);
    let mut moment = Moment::new(100);
    moment.fill(tick, 0.0, DVec3::ZERO);
    let body = |body: &Body, pose, part: BodyPart| ShownBody {
        part,
        solid: Arc::new(Solid::of_body(body)),
        pose,
        colour: part.colour(Theme::Light),
        look: Look::default(),
    };
    Scene {
        bodies: vec![body(&probe, pose, BodyPart::Probe), body(&table, Pose::IDENTITY, BodyPart::Environment)],
        force_scale: moment.wrench.force.length().max(0.1),
        moment: Some(moment),
        title: "a box on a table".into(),
        ..Scene::default()
    }
}

fn framed(scene: &Scene, view: View) -> Camera {
    Camera::framing(scene.corners(), view, WIDTH as f64 / HEIGHT as f64)
}

/// Returns a style that shows only the bodies.
fn bare() -> Style {
    Style { contacts: false, clusters: false, wrench: false, anchors: false, words: false, ..Style::default() }
}

fn taken(scene: &Scene, view: View, style: &Style) -> Picture {
    paint(scene, &framed(scene, view), style, WIDTH, HEIGHT)
}

/// Returns the columns and rows of the pixels in which two pictures differ.
fn differences(one: &Picture, other: &Picture) -> Vec<(usize, usize)> {
    let all = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    all.filter(|&(x, y)| one.pixel(x, y) != other.pixel(x, y)).collect()
}

/// Radius around a contact that its halo may change, pixels.
const HALO: f64 = 11.0;

#[test]
fn dots_are_only_at_contacts() {
    for (height, overlapping) in [(0.4e-3, false), (-0.4e-3, true)] {
        let scene = leaning(height);
        let moment = scene.moment.as_ref().expect("the scene has a moment");
        assert!(!moment.contacts.is_empty() && moment.contacts.iter().all(|c| (c.separation < 0.0) == overlapping));
        for view in [View::Oblique, View::Front, View::Left, View::Top] {
            let camera = framed(&scene, view);
            let without = taken(&scene, view, &bare());
            let with = taken(&scene, view, &Style { contacts: true, ..bare() });
            let places: Vec<_> = moment
                .contacts
                .iter()
                .map(|c| {
                    camera.project(c.point, WIDTH as f64, HEIGHT as f64).expect("the point is in front of the camera")
                })
                .collect();
            for place in &places {
                let [red, green, blue] = with.pixel(place.x as usize, place.y as usize).map(i32::from);
                let [r, g, b] = without.pixel(place.x as usize, place.y as usize).map(i32::from);
                // A hidden arrow is paler, but still changes the colour.
                let (to_red, to_green) = (red - r - (green - g), green - g - (red - r));
                let turned = if overlapping { to_red } else { to_green };
                assert!(turned > 15, "{view:?}: no dot at {place:?}: {red} {green} {blue} over {r} {g} {b}");
            }
            for (x, y) in differences(&with, &without) {
                let near = |p: &palpus_window::Projected| (x as f64 - p.x).hypot(y as f64 - p.y) < HALO;
                assert!(places.iter().any(near), "{view:?}: a mark at {x}, {y}, where there is no contact");
            }
        }
    }
}

#[test]
fn force_arrow_starts_at_the_grip() {
    let scene = leaning(-0.4e-3);
    let moment = scene.moment.as_ref().expect("the scene has a moment");
    let camera = framed(&scene, View::Front);
    let at = |p: DVec3| camera.project(p, WIDTH as f64, HEIGHT as f64).expect("the point is in front of the camera");
    let (tail, ahead) = (at(moment.grip), at(moment.grip + moment.wrench.force.normalize() * 0.01));
    let without = taken(&scene, View::Front, &bare());
    let with = taken(&scene, View::Front, &Style { wrench: true, ..bare() });
    let changed = differences(&with, &without);
    let along = |x: f64, y: f64| {
        let (dx, dy) = (ahead.x - tail.x, ahead.y - tail.y);
        ((x - tail.x) * dx + (y - tail.y) * dy) / dx.hypot(dy)
    };
    let farthest = changed.iter().map(|&(x, y)| along(x as f64, y as f64)).fold(f64::NEG_INFINITY, f64::max);
    let behind = changed.iter().map(|&(x, y)| along(x as f64, y as f64)).fold(f64::INFINITY, f64::min);
    // In a picture with a height of 800 pixels the longest arrow has 150 pixels. Here the height is
    // 200 pixels, so the arrow has 37.5. The arrow of the torque about the grip is smaller: it
    // reaches less than 14 pixels behind the grip.
    assert!((farthest - 37.5).abs() < 4.0 && behind > -14.0, "{farthest} {behind}");
}

#[test]
fn pictures_are_reproducible_and_not_blank() {
    let scene = leaning(-0.4e-3);
    for theme in [Theme::Light, Theme::Dark] {
        let style = Style { theme, ..Style::default() };
        let one = taken(&scene, View::Oblique, &style);
        assert_eq!(one, taken(&scene, View::Oblique, &style));
        let empty = paint(&Scene::default(), &framed(&scene, View::Oblique), &bare(), WIDTH, HEIGHT);
        let shown = differences(&taken(&scene, View::Oblique, &Style { theme, ..bare() }), &empty);
        assert!(shown.len() > WIDTH * HEIGHT / 8, "{} pixels", shown.len());
        let mut colours: Vec<_> = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y))).collect::<Vec<_>>();
        colours.sort_unstable_by_key(|&(x, y)| one.pixel(x, y));
        colours.dedup_by_key(|&mut (x, y)| one.pixel(x, y));
        assert!(colours.len() > 200, "{} colours", colours.len());
    }
}

#[test]
fn every_look_gives_another_picture() {
    let looks = [
        Look::default(),
        Look { pieces: true, ..Look::default() },
        Look { wireframe: true, ..Look::default() },
        Look { translucent: true, ..Look::default() },
    ];
    let pictures: Vec<Picture> = looks
        .iter()
        .map(|look| {
            let mut scene = leaning(-0.4e-3);
            scene.bodies.iter_mut().for_each(|body| body.look = *look);
            taken(&scene, View::Oblique, &bare())
        })
        .collect();
    for (k, one) in pictures.iter().enumerate() {
        for other in &pictures[..k] {
            assert!(differences(one, other).len() > 500);
        }
    }
}

#[test]
fn environment_is_transparent_only_around_the_probe() {
    let solid = leaning(0.0);
    let mut seen_through = solid.clone();
    seen_through.bodies[1].look.xray = true;
    // Seen from below, the table hides the box.
    let [without, with] = [&solid, &seen_through].map(|scene| taken(scene, View::Bottom, &bare()));
    let probe = framed(&solid, View::Bottom).project(solid.bodies[0].pose.translation, WIDTH as f64, HEIGHT as f64);
    let [x, y] = probe.map(|p| [p.x as usize, p.y as usize]).expect("the point is in front of the camera");
    let [red, _, blue] = with.pixel(x, y).map(i32::from);
    let [r, _, b] = without.pixel(x, y).map(i32::from);
    assert!(red - blue > r - b + 20, "the orange box must be visible through the table: {red} {blue}, without {r} {b}");
    let changed = differences(&without, &with);
    let share = changed.len() as f64 / (WIDTH * HEIGHT) as f64;
    assert!(share < 0.3 && changed.iter().all(|(x, y)| (10..WIDTH - 10).contains(x) && *y > 3), "{share}");
}

#[test]
fn device_probe_is_shown_if_away_from_the_tool() {
    let mut scene = leaning(-0.4e-3);
    let together = taken(&scene, View::Oblique, &bare());
    if let Some(moment) = &mut scene.moment {
        moment.device.translation.z += 0.01;
    }
    assert!(differences(&together, &taken(&scene, View::Oblique, &bare())).len() > 300);
}

#[test]
fn grip_is_marked_where_the_hand_has_it() {
    let mut scene = leaning(-0.4e-3);
    let style = Style { wrench: true, ..bare() };
    let (view, camera) = (View::Front, framed(&scene, View::Front));
    let together = taken(&scene, view, &style);
    let moment = scene.moment.as_mut().expect("a moment");
    moment.hand += DVec3::X * 0.02;
    let (hand, tool) = (moment.hand, moment.grip);
    let apart = taken(&scene, view, &style);
    // The place of the hand's grip, and the place half way from there to the tool's grip.
    let changed = differences(&together, &apart);
    for point in [hand, hand.lerp(tool, 0.5)] {
        let place = camera.project(point, WIDTH as f64, HEIGHT as f64).expect("ahead of the eye");
        assert!(changed.contains(&(place.x as usize, place.y as usize)), "nothing at {place:?}");
    }
    assert_eq!(differences(&taken(&scene, view, &bare()), &taken(&leaning(-0.4e-3), view, &bare())), []);
}

#[test]
fn every_request_gives_a_picture() {
    let scene = leaning(0.0);
    let inside = Camera { target: DVec3::ZERO, distance: 1e-4, yaw: 0.3, pitch: 0.2 };
    let far = Camera { distance: 1e6, ..inside };
    for camera in [inside, far] {
        assert_eq!(paint(&scene, &camera, &Style::default(), 33, 17).bytes().len(), 33 * 17 * 3);
    }
    let nothing = Scene::default();
    let camera = Camera::framing(nothing.corners(), View::Top, 1.0);
    assert_eq!(paint(&nothing, &camera, &Style::default(), 16, 16).width(), 16);
}

/// Returns a block in the shape of an L, two units wide.
fn l_block() -> Body {
    let outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    let vertices = [0.0, 1.0].iter().flat_map(|&z| outline.map(|(x, y)| DVec3::new(x, y, z))).collect();
    let mut soup = PolygonSoup { vertices, ..PolygonSoup::new() };
    soup.push_face(&[5, 4, 3, 2, 1, 0]);
    soup.push_face(&[6, 7, 8, 9, 10, 11]);
    for k in 0..6 {
        soup.push_face(&[k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k]);
    }
    Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).expect("the mesh is valid")
}

#[test]
fn gauss_map_is_coloured_only_where_directions_are_owned() {
    let body = l_block();
    let (size, middle) = (240, 120.0);
    for piece in 0..body.polytopes().len() as u32 {
        let own = body.admissible_normals(piece);
        let camera = Camera::framing([DVec3::ZERO].into_iter(), View::Oblique, 1.0);
        let picture = paint_gauss_half(&body, piece, &camera, Theme::Light, size);
        assert_eq!(picture, paint_gauss_half(&body, piece, &camera, Theme::Light, size));
        let [right, up, back] = camera.axes();
        // Counts, for owned and for other directions: all pixels, and pixels with the expected
        // colour.
        let (mut seen, mut right_colour) = ([0, 0], [0, 0]);
        for (x, y) in (0..size).step_by(3).flat_map(|y| (0..size).step_by(3).map(move |x| (x, y))) {
            let (u, v) = ((x as f64 + 0.5 - middle) / (0.96 * middle), (middle - y as f64 - 0.5) / (0.96 * middle));
            if u.hypot(v) > 0.95 {
                continue;
            }
            let direction = right * u + up * v + back * (1.0 - u * u - v * v).sqrt();
            let [r, g, b] = picture.pixel(x, y).map(i32::from);
            let owned = own.vertex_admits(own.polytope().support(direction), direction);
            let is_grey = (r - g).abs() < 8 && (g - b).abs() < 12;
            seen[usize::from(owned)] += 1;
            right_colour[usize::from(owned)] += i32::from(is_grey != owned);
        }
        assert!(seen[1] > 300, "piece {piece}: {seen:?}");
        // Up to a fifth of the pixels may have another colour, because points and arcs are drawn
        // over the regions.
        assert!((0..2).all(|k| 10 * right_colour[k] >= 8 * seen[k]), "piece {piece}: {right_colour:?} of {seen:?}");
    }
}

#[test]
fn page_of_a_piece_has_text_and_spheres_at_any_size() {
    let body = l_block();
    let shown = PieceOf { body: &body, piece: 0, name: "l.obj", unit: Unit::Model };
    let camera = before_surface_faces(&body, 0);
    for (width, height) in [(640, 400), (16, 16), (40, 300), (300, 40)] {
        let page = paint_gauss(&shown, &camera, &Style::default(), width, height);
        assert_eq!((page.width(), page.height()), (width, height));
    }
    let with = paint_gauss(&shown, &camera, &Style::default(), WIDTH, HEIGHT);
    let without = paint_gauss(&shown, &camera, &Style { words: false, ..Style::default() }, WIDTH, HEIGHT);
    assert!(differences(&with, &without).len() > 1000);
}

#[test]
fn section_is_coloured_by_depth_inside_and_pale_outside() {
    let body = Arc::new(l_block());
    let plane = SectionPlane::through(&body, Axis::Z, 0.5);
    let section = Section::of(&body, plane, 96, &Alone, &mut |_| ()).expect("the section can be computed");
    let numbers = section.numbers();
    assert!(numbers.unseen == 0 && (numbers.deepest - 0.5).abs() < 0.05, "{numbers:?}");
    let shown = SectionOf { section: &section, body: &body, name: "l.obj", unit: Unit::Model };
    let (width, height) = (section.columns * 2, section.rows * 2);
    for which in [Shown::Felt, Shown::True] {
        let panel = paint_section_panel(&shown, which, 0.5, Theme::Light, width, height);
        let at = |x: f64, y: f64| {
            let column = 2.0 * ((x - section.low[0]) / section.cell + 0.5);
            panel.pixel(column as usize, height - 1 - (2.0 * ((y - section.low[1]) / section.cell + 0.5)) as usize)
        };
        let near = |colour: [u8; 3], part: f64| {
            let wanted = depth_colour(part);
            colour.iter().zip(wanted).map(|(a, b)| (i32::from(*a) - i32::from(b)).abs()).max().unwrap_or(0) < 16
        };
        // At the middle of the long arm the nearest face is 0.3 away. The contour lines are
        // elsewhere.
        assert!(near(at(1.57, 0.27), 0.54), "{which:?}: {:?}", at(1.57, 0.27));
        assert!(near(at(1.57, 0.07), 0.14), "{which:?}: {:?}", at(1.57, 0.07));
        let [r, g, b] = at(1.8, 1.8);
        assert!(r > 180 && g > 180 && b > 180, "the notch must be pale: {r} {g} {b}");
    }
    let page = paint_section(&shown, &Style::default(), 400, 250);
    assert_eq!(page, paint_section(&shown, &Style::default(), 400, 250));
    for (width, height) in [(16, 16), (300, 40), (40, 300)] {
        assert_eq!(paint_section(&shown, &Style::default(), width, height).width(), width);
    }
}
