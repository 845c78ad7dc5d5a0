//! A scenario fails when it should: each kind of expectation, what is left over, what is no line, and what
//! it says then. Where a network is joined, it is by M587, so that little is assumed about the policy.

mod coverage;
mod updates;

use host_tests::scenario::{Failure, play};

/// Four lines.
const CONNECTED: &str = r#"power on
the computer joins "Line-us-Setup"
A connects
A hears hello ...
"#;
/// Seven more.
const AT_HOME: &str = r#"network "home" up, password "correct horse"
A sends M587 Shome P"correct horse"
A hears ok
machine joins "home" within 20 s
light blue
the computer joins "home"
B connects
"#;

fn failure(text: &str) -> Failure {
    *play("test", text).expect_err("it comes true")
}

/// `lines` after a beginning that comes true fail in the last of them, with `instead`.
fn fails_after(beginning: &str, lines: &str, instead: &str) {
    let text = format!("{beginning}{lines}\n");
    let failure = failure(&text);
    let last = text.lines().last().expect("there is a line");
    assert_eq!(failure.line, text.lines().count(), "{failure}");
    assert_eq!(failure.expected, last, "{failure}");
    assert!(failure.instead.contains(instead), "{failure}");
}

fn fails(lines: &str, instead: &str) {
    fails_after(CONNECTED, lines, instead);
}

/// All of `lines` come true, but something is left over at their end.
fn leaves(lines: &str, instead: &str) {
    let text = format!("{CONNECTED}{lines}\n");
    let failure = failure(&text);
    assert_eq!(failure.line, text.lines().count(), "{failure}");
    assert_eq!(
        failure.expected, "nothing that no line expected",
        "{failure}"
    );
    assert!(failure.instead.contains(instead), "{failure}");
}

fn comes_true(text: &str) {
    if let Err(failure) = play("test", text) {
        panic!("{failure}");
    }
}

#[test]
fn what_the_tests_begin_with_comes_true() {
    comes_true(CONNECTED);
    comes_true(&format!("{CONNECTED}{AT_HOME}B hears hello ...\n"));
    comes_true("");
}

#[test]
fn a_failure_tells_where_what_and_what_before() {
    let told = failure(&format!(
        "{CONNECTED}# a remark\n\nA sends M550\nA hears ok"
    ))
    .to_string();
    let mut lines = told.lines();
    assert_eq!(lines.next(), Some("test:8"));
    assert_eq!(lines.next(), Some("  expected: A hears ok"));
    assert_eq!(
        lines.next(),
        Some("  instead:  A hears ok MACHINENAME:line-us")
    );
    let journal: Vec<&str> = lines.collect();
    for entry in [
        "    0.000 s 1: power on",
        "    0.000 s     radio: opens \"Line-us-Setup\"",
        "    0.000 s     log: setup network opened",
    ] {
        let words = |text: &str| {
            text.split_whitespace()
                .skip(2)
                .collect::<Vec<_>>()
                .join(" ")
        };
        assert!(
            journal.iter().any(|line| words(line) == words(entry)),
            "{entry}: {told}"
        );
    }
}

#[test]
fn clients_hear_what_they_hear() {
    fails("A hears ok", "A hears nothing");
    fails(
        "A sends M550\nA hears nothing for 1 s",
        "A hears ok MACHINENAME:line-us",
    );
    fails(
        "A sends M550\nA hears one of: ok NAME:x | ok",
        "A hears ok MACHINENAME:line-us",
    );
    fails(
        "A sends M550\nA sends M114\nA hears several: ok MACHINENAME:...",
        "A hears ok X:1000 Y:1000 Z:1000",
    );
    fails("A hears several: ok ...", "A hears nothing");
    fails(
        "A sends G01 X1500 Z0\nA hears ok ...\nA sends G01 X1000\nA hears ok ... within 300 ms",
        "A hears nothing",
    );
    fails("A is disconnected", "A stays connected");
    fails("B hears ok", "B is not connected");
    fails(
        "A closes\nA sends M550\nA hears ok ...",
        "A is disconnected",
    );
}

#[test]
fn clients_connect_where_the_machine_can_be_reached() {
    fails("A connects", "A is connected already");
    fails("B cannot connect", "it can");
    fails(
        "the computer leaves\nB connects",
        "the computer is in no network",
    );
    fails(
        "network \"other\" up\nthe computer joins \"other\"\nB connects",
        "the computer is in \"other\"; the machine has joined none and opened \"Line-us-Setup\"",
    );
    fails("cut the power\nB connects", "the machine has no power");
    fails(
        "the computer joins \"nowhere\"",
        "network \"nowhere\" is not there",
    );
}

#[test]
fn what_a_client_hears_too_much_is_left_over() {
    leaves("A sends M550", "A hears ok MACHINENAME:line-us");
    leaves(
        "B connects\nC connects\nB ignores what it hears",
        "C hears hello",
    );
    let five = "B connects\nC connects\nD connects\nE connects\n";
    let ignored = "B ignores what it hears\nC ignores what it hears\nD ignores what it hears\n";
    leaves(
        &format!("{five}{ignored}E hears error ..."),
        "E is disconnected (Closed)",
    );
}

#[test]
fn the_light_shows_what_it_shows() {
    let red = "the light is red flashing";
    fails("light blue", red.trim_start_matches("the light is "));
    fails("light red flashing fast", "red flashing");
    fails("light red", "red flashing");
    fails("light red and white in turn", "red flashing");
    fails(
        "light red flashing\nlight was never red",
        "the light was red",
    );
    fails(
        "light red flashing\ncut the power\nlight red flashing",
        "the light is dark",
    );
    let lost = format!("{CONNECTED}{AT_HOME}B hears hello ...\nnetwork \"home\" down\n");
    fails_after(&lost, "light stays blue for 5 s", "the light changes: ");
    comes_true(
        &format!("{CONNECTED}light stays red flashing for 30 s\nlight was never green\n")
            .replace("light stays", "light red flashing\nlight stays"),
    );
}

#[test]
fn a_light_that_changes_after_the_last_look_is_left_over() {
    let text = format!(
        "{CONNECTED}{AT_HOME}B hears hello ...\nthe machine may try \"home\"\nnetwork \"home\" down\n"
    );
    let failure = failure(&text);
    assert_eq!(
        failure.expected, "nothing that no line expected",
        "{failure}"
    );
    assert!(failure.instead.contains("(it was blue)"), "{failure}");
}

#[test]
fn the_radio_does_what_it_does() {
    let setup = "power on\n";
    fails_after(
        setup,
        "the machine opens \"Mine\"",
        "the machine opens \"Line-us-Setup\"",
    );
    fails_after(
        setup,
        "the machine opens \"Line-us-Setup\", password \"correct horse\"",
        "the machine opens \"Line-us-Setup\"",
    );
    fails(
        "the machine opens \"Line-us-Setup\"",
        "the machine opens no network",
    );
    fails("the machine closes its network", "it stays open");
    fails(
        "the machine is found as \"other\"",
        "it is found as line-us",
    );
    fails(
        "the machine is found as \"line-us\"\nthe machine is not found",
        "it is found as line-us",
    );
    fails("the machine joins \"home\"", "the machine tries no network");
    let told = "network \"home\" up, password \"correct horse\"\nA sends M587 Shome P\"wrong horse\"\nA hears ok\n";
    fails(
        &format!("{told}the machine joins \"home\""),
        "the machine tries \"home\": WrongPassword",
    );
    fails(
        &format!("{told}the machine does not find \"home\""),
        "the machine tries \"home\": WrongPassword",
    );
    fails(
        &format!("{told}the machine is refused by \"other\""),
        "the machine tries \"home\": WrongPassword",
    );
    fails(
        &format!("{told}the machine tries nothing for 10 s"),
        "the machine tries \"home\": WrongPassword",
    );
}

#[test]
fn what_the_radio_does_too_much_is_left_over() {
    let opened = failure("power on\nlight red flashing\n");
    assert_eq!(opened.line, 2, "{opened}");
    assert_eq!(opened.instead, "the machine opens \"Line-us-Setup\"");
    let lines = "network \"home\" up\nA sends M587 Shome\nA hears ok\nwait 10 s";
    leaves(lines, "the machine tries \"home\": Yes");
    comes_true(&format!(
        "{CONNECTED}the machine may try \"home\"\n{lines}\n"
    ));
    // What may be tried is one network, not any.
    leaves(
        &format!("the machine may try \"other\"\n{lines}"),
        "the machine tries \"home\": Yes",
    );
}

#[test]
fn the_arm_is_where_it_is() {
    fails(
        "arm rests at 1000 1000 0",
        "it rests at 1000.00 1000.00 1000.00 (home)",
    );
    fails(
        "A sends G01 X1500 Z0\nA hears ok ...\narm rests within 100 ms",
        "it moves at 10",
    );
    fails(
        "A sends G01 X1100\nA hears ok ...\narm stays for 1 s",
        "it moves at 2.3",
    );
    fails("pen is down", "it is at 1000.00 1000.00 1000.00");
    fails(
        "A sends G01 Z0\nA hears ok ...\npen stays up for 1 s",
        "it is at 1000.00 1000.00 49",
    );
    fails("nib passes 1100 1000", "it comes no closer than 1000.00");
    let corner = "A sends G01 X1100 Z0\nA sends G01 Y900\nA hears ok ...\nA hears ok ...\n";
    fails(
        &format!("{corner}nib passes 1101 1000"),
        "it comes no closer than 1100.00 1000.00 0.00",
    );
    fails(
        &format!("{corner}nib passes 1100 900\nnib passes 1100 1000"),
        "it comes no closer than 1100.00 900.00 0.00",
    );
    fails(
        &format!("{corner}nib passes 1100 1000 1000"),
        "it comes no closer",
    );
}

#[test]
fn a_wave_is_little_near_home_with_the_pen_up_and_ends_there() {
    // A client can wave, too, in one go.
    let waved = |lines: &str| format!("A sends bytes \"{lines}\"\nA ignores what it hears\n");
    comes_true(&format!(
        "{CONNECTED}{}arm waves\n",
        waved(r"G01 Z900\nG28\n")
    ));
    comes_true(&format!("{CONNECTED}arm waves\n"));
    fails("wait 1 s\narm waves", "it does not move");
    fails(
        &format!("{}arm waves", waved(r"G01 Z900\n")),
        "it moves, and is at 1000.00 1000.00 900.00",
    );
    fails(&format!("{}arm waves", waved(r"G01 Z0\nG28\n")), "it moves");
    fails(&format!("{}arm waves", waved(r"G01 Y0\nG28\n")), "it moves");
    // The line waits from the last thing that the script did.
    fails(
        &format!(
            "{}arm waves\nwait 1 s\narm waves",
            waved(r"G01 Z900\nG28\n")
        ),
        "it does not move",
    );
}

#[test]
fn the_memory_holds_what_it_holds() {
    let name = "A sends M550 Probs-arm\nA hears ok ...\n";
    fails(
        &format!("{name}machine remembers nothing"),
        "name robs-arm, 0 networks",
    );
    fails(
        &format!("{name}machine remembers name anns-arm or sues-arm"),
        "name robs-arm, 0 networks",
    );
    fails(
        "machine remembers network \"home\"",
        "name line-us, 0 networks",
    );
    fails("machine remembers 2 networks", "name line-us, 0 networks");
    let home = format!("{CONNECTED}{AT_HOME}B hears hello ...\n");
    fails_after(
        &home,
        "machine remembers no network",
        "1 networks: \"home\"",
    );
    fails_after(
        &home,
        "machine remembers network \"home\", password \"other horse\"",
        "1 networks: \"home\"",
    );
}

#[test]
fn power_is_off_when_it_is_cut() {
    fails("power is off", "power is on");
    fails(
        "the power fails after 1000000 bytes\nA sends M550 Px\nA hears ok ...\npower is off",
        "power is on",
    );
    comes_true(&format!(
        "{CONNECTED}the power fails after 4 bytes\nA sends M550 Px\nthe power is off\n\
         machine remembers name line-us\n"
    ));
}

#[test]
fn a_line_that_says_nothing_fails_before_anything_is_played() {
    for (line, why) in [
        ("the machine flies", "the machine does no such thing"),
        ("A flies", "a client does no such thing"),
        ("fly", "no such line"),
        ("wait", "a number is missing"),
        ("wait 5", "a time has a unit"),
        ("wait 5 s within 3 s", "no 'within'"),
        ("power on quickly", "\"quickly\" is not understood"),
        ("light pink", "\"pink\" is no colour of the light"),
        ("light stays blue", "for how long?"),
        ("network \"\" up", "1 to 32 bytes"),
        ("network home up, password short", "8 to 63 bytes"),
        ("network home, -50", "a strength has a unit"),
        ("the memory is full", "empty, garbage, worn out or well"),
        ("the memory holds update address x", "an address is http://"),
        ("the server flies", "the server does no such thing"),
        ("the server offers nine", "a version is three numbers"),
        (
            "the server offers 9.0.0 gladly",
            "\"gladly\" is not understood",
        ),
        ("the server closes after 5", "a number of bytes is missing"),
        (
            "the server sends 0 bytes every 1 s",
            "a number of bytes every so often",
        ),
        ("the server's name is x", "a manifest and an image"),
        ("for each N from 1 to 2", "no such line"),
    ] {
        let failure = failure(&format!("power on\n{line}\n"));
        assert_eq!(
            (failure.line, &*failure.expected),
            (2, "a line of a scenario"),
            "{failure}"
        );
        assert!(failure.instead.contains(why), "{failure}");
        // Nothing was played.
        assert!(failure.journal.is_empty(), "{failure}");
    }
}

#[test]
fn what_the_script_cannot_do_fails() {
    fails("network \"home\" down", "network \"home\" was never up");
    fails("the link is lost", "the machine is in no network");
    fails("B sends M550", "B is not connected");
    let gone =
        "B connects\nC connects\nD connects\nE connects\nE hears error ...\nE is disconnected\n";
    fails(&format!("{gone}E sends M550"), "E is disconnected (Closed)");
}

#[test]
fn a_scenario_for_each_value_names_the_one_that_fails() {
    let text =
        "for each X from 998 to 1002\n# <X>\npower on\narm rests at <X> 1000 1000 within 1 s\n";
    let told = failure(text);
    assert_eq!(told.scenario, "test (X = 998)");
    assert_eq!(
        (told.line, &*told.expected),
        (4, "arm rests at 998 1000 1000 within 1 s")
    );
    let wrong = failure("\nfor each X to 3\npower on");
    assert_eq!(
        (wrong.line, &*wrong.instead),
        (2, "'from' or 'in' is missing")
    );
}

#[test]
fn the_same_scenario_goes_the_same_way() {
    let text =
        format!("{CONNECTED}{AT_HOME}B hears hello ...\nA sends M122\nB sends M122\nB hears x");
    let once = failure(&text).to_string();
    assert_eq!(once, failure(&text).to_string());
}
