//! The picture of what the servos did.

use host_tests::desktop::{Desktop, draw, wait_until};
use std::fs;
use std::path::Path;

/// Points of all polylines of a class.
fn points(picture: &Path, class: &str) -> usize {
    let text = fs::read_to_string(picture).expect("the picture is there");
    let svg = roxmltree::Document::parse(&text).unwrap_or_else(|error| {
        panic!("{} is not well-formed: {error}", picture.display());
    });
    assert_eq!(svg.root_element().tag_name().name(), "svg");
    svg.descendants()
        .filter(|node| node.has_tag_name_and_class("polyline", class))
        .filter_map(|node| node.attribute("points"))
        .map(|points| points.split_whitespace().count())
        .sum()
}

trait Look {
    fn has_tag_name_and_class(&self, tag: &str, class: &str) -> bool;
}

impl Look for roxmltree::Node<'_, '_> {
    fn has_tag_name_and_class(&self, tag: &str, class: &str) -> bool {
        self.tag_name().name() == tag && self.attribute("class") == Some(class)
    }
}

#[test]
fn the_picture_is_rewritten_whenever_the_arm_comes_to_rest() {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start(folder.path(), &["--speed", "max"]);
    assert_eq!(points(arm.picture(), "ink"), 0, "an empty sheet at first");
    let mut client = arm.client();
    let mut before = 0;
    for x in [1200, 1300, 1400] {
        for line in ["G01 Y900 Z0", &format!("G01 X{x} Y500"), "G01 Z1000"] {
            client.say(line);
        }
        wait_until(&format!("ink up to X {x}"), || {
            points(arm.picture(), "ink") > before
        });
        before = points(arm.picture(), "ink");
        assert!(points(arm.picture(), "travel") > 0, "no travel is drawn");
    }
}

#[test]
fn a_picture_named_png_is_one() {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start_with_picture(folder.path(), "arm.png", &["--speed", "max"]);
    let sheet = dark_pixels(arm.picture());
    let mut client = arm.client();
    for line in [
        "G01 X700 Y0 Z0",
        "G01 X1500 Y0",
        "G01 X1500 Y800",
        "G01 Z1000",
    ] {
        client.say(line);
    }
    wait_until("ink on the picture", || {
        dark_pixels(arm.picture()) > sheet + 100
    });
}

/// Pixels that are nearly black.
fn dark_pixels(picture: &Path) -> usize {
    let file = fs::File::open(picture).expect("the picture is there");
    let mut reader = png::Decoder::new(std::io::BufReader::new(file))
        .read_info()
        .expect("the picture is a PNG");
    let mut bytes = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut bytes).expect("the PNG is whole");
    let channels = info.color_type.samples();
    bytes
        .chunks(channels)
        .filter(|pixel| pixel.iter().take(3).all(|&value| value < 80))
        .count()
}

#[test]
fn points_that_were_limited_are_marked() {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let script = folder.path().join("limited.gcode");
    fs::write(&script, "G01 X510 Y300 Z0\nG01 X720 Y-300\nG01 X3000 Y0\n")
        .expect("a file can be written");
    let picture = folder.path().join("limited.svg");
    let run = draw(&script, &["--picture", &picture.to_string_lossy()]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert_eq!(run.field("points limited"), "2");
    let text = fs::read_to_string(&picture).expect("the picture is there");
    let svg = roxmltree::Document::parse(&text).expect("the picture is well-formed");
    let marks = svg
        .descendants()
        .filter(|node| node.tag_name().name() == "circle")
        .count();
    assert!(
        marks > 20,
        "{marks} marks for a way that is held for 50 steps"
    );
}

#[test]
fn a_picture_of_another_kind_is_refused_at_the_start() {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let script = folder.path().join("empty.gcode");
    fs::write(&script, "").expect("a file can be written");
    let picture = folder.path().join("picture.jpg");
    let run = draw(&script, &["--picture", &picture.to_string_lossy()]);
    assert_ne!(run.status, 0);
    assert!(run.stderr.contains("picture.jpg"), "{}", run.stderr);
}
