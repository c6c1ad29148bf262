//! Tests of the viewer of models and recordings, on a virtual display (Xvfb).
#![cfg(all(feature = "window", target_os = "linux"))]

mod display;

use std::fs;

use display::{Display, WHOLE, orange};

/// A cube of side 2 about the origin.
const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// True for the colour of the deepest regions in a section. Nothing else in the window has this
/// colour.
fn yellow([r, g, b]: [i32; 3]) -> bool {
    r > 170 && g > 200 && b < 80
}

/// True for the colour of the real faces of a piece, and of their normals.
fn blue([r, g, b]: [i32; 3]) -> bool {
    b > r + 40 && b > g + 15
}

#[test]
#[ignore = "needs Xvfb, Mesa and xdotool (apt-get install xvfb xdotool libgl1-mesa-dri libxkbcommon-x11-0 libxcursor1 libxi6)"]
fn click_picks_a_piece_and_key_shows_depth() {
    let display = Display::open("viewer");
    fs::write(display.folder.join("cube.obj"), CUBE).expect("the file can be written");
    let _window = display.show(&["view", "cube.obj"]);
    let anything = |[r, g, b]: [i32; 3]| r + g + b > 90;
    display.wait_for("window", 100_000, &WHOLE, anything);
    display.focus();
    display.input("mousemove 450 400");
    display.input("click 1");
    display.wait_for("Gauss map and picked piece", 40_000, &WHOLE, blue);
    display.input("key d");
    display.wait_for("section", 200, &WHOLE, yellow);
    display.input("key Escape");
    display.input("key s");
    display.wait_for_picture("palpus-out/window-1.png");
}

#[test]
#[ignore = "needs Xvfb, Mesa and xdotool (apt-get install xvfb xdotool libgl1-mesa-dri libxkbcommon-x11-0 libxcursor1 libxi6)"]
fn player_shows_the_chosen_moment_of_a_recording() {
    let display = Display::open("player");
    let run = ["run", "spoon-cup", "--fast", "--duration", "3", "--record", "run.csv", "--headless"];
    assert!(display.palpus(&run).output().expect("the program starts").status.success());
    let _window = display.show(&["replay", "run.csv", "--view"]);
    display.wait_for("spoon", 1000, &WHOLE, orange);
    display.focus();
    // Contact begins within three seconds. At the largest force, dots show the contacts.
    display.input("key m");
    let dot = |[r, g, b]: [i32; 3]| (r > 200 && g < 110 && b < 110) || (g > 180 && r < 110 && b < 140);
    display.wait_for("contacts", 30, &WHOLE, dot);
    display.input("key s");
    display.wait_for_picture("palpus-out/window-1.png");
}
