//! Bytes, lines, messages (`reference/line-us.md`, sections 2 and 3).

use host_tests::desktop::{Client, Desktop};
use std::thread;
use std::time::Duration;

fn arm() -> (tempfile::TempDir, Desktop) {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start(folder.path(), &["--speed", "max"]);
    (folder, arm)
}

const HOME: &str = "ok X:1000 Y:1000 Z:1000";

#[test]
fn the_greeting_has_version_name_and_serial() {
    let (_folder, arm) = arm();
    let hello = arm.connect().reply();
    let rest = hello
        .strip_prefix("hello VERSION:\"")
        .unwrap_or_else(|| panic!("{hello:?}"));
    let (version, rest) = rest.split_once("\" NAME:").expect("a quoted version");
    let (name, serial) = rest.split_once(" SERIAL:").expect("a name, a serial");
    assert!(!version.is_empty() && name == "line-us", "{hello:?}");
    let serial: u32 = serial.parse().expect("the serial is decimal");
    assert!(serial < 1 << 24, "{serial} is more than 24 bits");
}

#[test]
fn every_terminator_seen_on_the_wire_ends_a_command() {
    let (_folder, arm) = arm();
    for terminator in [
        "\0", "\0\n", "\r\n\0", "\n", "\r\n", "\r", "\n\r", "\0\0\0", "\n\n\n", " \n \n", "\t\r\n",
    ] {
        let mut client = arm.client();
        client.send(format!("Q1{terminator}Q2{terminator}"));
        for code in ["Q1", "Q2"] {
            let expected = format!("error INFO:\"unknown command '{code}'\"");
            assert_eq!(client.reply(), expected, "after {terminator:?}");
        }
        // Nothing between the terminators was a line: the next reply is the next command's.
        assert_eq!(client.say("M114"), HOME, "after {terminator:?}");
    }
}

#[test]
fn empty_lines_are_never_answered() {
    let (_folder, arm) = arm();
    let mut client = arm.client();
    client.send("\r\n\0\n\n\0\0\r \t \n");
    assert!(client.hears_nothing_for(Duration::from_millis(200)));
    assert_eq!(client.say("M114"), HOME);
}

#[test]
fn commands_as_clients_really_write_them() {
    let (_folder, arm) = arm();
    let mut client = arm.client();
    for (line, reply) in [
        ("G01  X1000", HOME),
        ("G28 ", HOME),
        ("g01 x900 y300 z1", "ok X:900 Y:300 Z:1"),
        ("G1 X901", "ok X:901 Y:300 Z:1"),
        ("G0 X902", "ok X:902 Y:300 Z:1"),
        ("G01 X912.345", "ok X:912 Y:300 Z:1"),
        ("G01 X900.0000", "ok X:900 Y:300 Z:1"),
        ("G01 Y999.9999999", "ok X:900 Y:1000 Z:1"),
        ("G01 Y1.5e-07", "ok X:900 Y:0 Z:1"),
        ("G01 Y1E2 Z1e+3", "ok X:900 Y:100 Z:1000"),
        ("G01 X\"950\"", "ok X:950 Y:100 Z:1000"),
        ("G01 X960 F5000", "ok X:960 Y:100 Z:1000"),
        ("G01 X970 (not 980) ; nor 990", "ok X:970 Y:100 Z:1000"),
        ("undefined", "error INFO:\"unknown command 'undefined'\""),
        ("M115", "ok CONNECTMODE:ST MACHINENAME:line-us"),
        ("M550", "ok MACHINENAME:line-us"),
        ("G94 S5 ", "ok "),
        ("g54 x0 y0 s1", "ok "),
    ] {
        assert_eq!(client.say(line), reply, "{line:?}");
    }
    client.say("G28");
    client.wait_for_place(HOME);
    assert_eq!(client.say("M114 S"), "ok S:135.00 E:45.00 P:135.00");
}

#[test]
fn nothing_else_than_ok_is_written_with_a_space() {
    let (_folder, arm) = arm();
    let mut client = arm.client();
    client.send("G94 S5\n");
    assert_eq!(client.receive_once(256), b"ok \r\n\0");
}

#[test]
fn commands_before_the_greeting_was_read_are_answered_after_it() {
    let (_folder, arm) = arm();
    let mut client = arm.connect();
    client.send("M114\nM550\n");
    assert!(client.reply().starts_with("hello "));
    assert_eq!(client.reply(), HOME);
    assert_eq!(client.reply(), "ok MACHINENAME:line-us");
}

#[test]
fn a_command_may_arrive_byte_by_byte() {
    let (_folder, arm) = arm();
    let mut client = arm.client();
    for byte in b"G01 X1100 Y-5e1\r\n\0M114 S\0\nQ\n" {
        client.send([*byte]);
        thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(client.reply(), "ok X:1100 Y:-50 Z:1000");
    assert!(client.reply().starts_with("ok S:"));
    assert_eq!(client.reply(), "error INFO:\"unknown command 'Q'\"");
}

#[test]
fn a_lock_step_client_gets_each_reply_whole_in_one_receive() {
    let (_folder, arm) = arm();
    let mut client = arm.connect();
    for line in [
        "",
        "M114\n",
        "G01 X1100 Z0\0",
        "G01 X3000 Y0 Z0\r\n",
        "undefined\n",
        "M115\n",
        "M550\n",
        "G94 S4\n",
        "G01 Xnan\n",
        "M114 S\n",
    ] {
        client.send(line);
        let message = client.receive_once(256);
        assert!(
            message.ends_with(b"\r\n\0") && message.iter().filter(|&&byte| byte == 0).count() == 1,
            "{line:?} is answered in pieces, or with more than one message: {:?}",
            String::from_utf8_lossy(&message)
        );
    }
    client.send("M122\n");
    assert!(client.receive_once(1024).ends_with(b"\r\n\0"));
}

#[test]
fn a_line_too_long_is_one_error_and_the_next_line_is_fine() {
    let (_folder, arm) = arm();
    let mut client = arm.client();
    for length in [257, 1000, 100_000] {
        client.send(format!("G01 X{}\nM114\n", "1".repeat(length - 5)));
        let reply = client.reply();
        assert!(
            reply.starts_with("error INFO:\"") && reply.contains("256"),
            "{length} bytes: {reply:?}"
        );
        assert_eq!(client.reply(), HOME, "after {length} bytes");
    }
    // The longest network command: 32 and 63 quotes, each written twice.
    let longest = format!("M587 S\"{}\" P\"{}\"", "\"\"".repeat(32), "\"\"".repeat(63));
    assert_eq!(client.say(&longest), "ok ");
}

#[test]
fn bytes_that_are_not_utf8_are_an_error_of_their_line() {
    let (_folder, arm) = arm();
    let mut client = arm.client();
    client.send(b"\xff\xfe\xfd\nG01 X9\xc300\nM114\n");
    for _ in 0..2 {
        let reply = client.reply();
        assert!(
            reply.starts_with("error INFO:\"") && reply.contains("UTF-8"),
            "{reply:?}"
        );
    }
    assert_eq!(client.reply(), HOME);
}

#[test]
fn a_refusal_names_the_letter_and_changes_nothing() {
    let (_folder, arm) = arm();
    let mut client = arm.client();
    for (line, names) in [
        ("G01 X1100 Q5", "Q"),
        ("G01 X1100 X1200", "X"),
        ("G01 X1100 Y", "Y"),
        ("G01 X1100 Znan", "Z"),
        ("G01 X1100 Z-inf", "Z"),
        ("G01 X0x44C", "X"),
        ("G01 X1e9", "X"),
        ("G54 X50 S0", "S"),
        ("G94 P5 S31", "S"),
        ("G00 X1100 Y\"5", "Y"),
        ("M9999", "M9999"),
        ("M587 Sx Py", "P must"),
        ("M588 Sx", "'x'"),
        ("M552 S5", "S must"),
        ("M291 Sx", "S"),
        ("M997 Sx", "S is"),
    ] {
        let reply = client.say(line);
        let reason = reply.strip_prefix("error INFO:\"").unwrap_or_else(|| {
            panic!("{line:?} is not refused: {reply:?}");
        });
        assert!(reason.contains(names), "{line:?}: {reply:?}");
    }
    assert_eq!(client.say("M114"), HOME);
    assert_eq!(client.say("G01"), HOME);
}

#[test]
fn each_token_of_m122_has_a_colon() {
    let (_folder, arm) = arm();
    let mut client = arm.client();
    client.say("M550 Pquill-7");
    let reply = client.say("M122");
    let tokens = shell_split(reply.strip_prefix("ok ").expect("M122 is answered ok"));
    for token in &tokens {
        assert!(token.contains(':'), "{token:?} in {reply:?}");
    }
    let value = |key: &str| {
        let found = tokens.iter().find_map(|token| token.strip_prefix(key));
        found.unwrap_or_else(|| panic!("no {key} in {reply:?}"))
    };
    assert_eq!(value("name:"), "quill-7");
    assert_eq!(value("Cal:"), "0.00,0.00,0.00");
    assert_eq!(value("Position:"), "1000,1000,1000");
    assert_eq!(value("mac:").split(':').count(), 6);
    for key in [
        "Serial:",
        "Version:",
        "Uptime:",
        "FreeHeap:",
        "ResetReason:",
    ] {
        assert!(!value(key).is_empty(), "{key} is empty in {reply:?}");
    }
}

/// Splits at blanks outside double quotes, which vanish: Python's `shlex.split`.
fn shell_split(text: &str) -> Vec<String> {
    let (mut tokens, mut quoted) = (vec![String::new()], false);
    for letter in text.chars() {
        match (letter, quoted) {
            ('"', _) => quoted = !quoted,
            (' ', false) => tokens.push(String::new()),
            _ => tokens.last_mut().expect("never empty").push(letter),
        }
    }
    tokens.retain(|token| !token.is_empty());
    tokens
}

#[test]
fn a_client_that_only_listens_hears_the_greeting_and_nothing_else() {
    let (_folder, arm) = arm();
    let mut listener: Client = arm.client();
    let mut drawer = arm.client();
    drawer.say("G01 X1100");
    drawer.wait_for_place("ok X:1100 Y:1000 Z:1000");
    assert!(listener.hears_nothing_for(Duration::from_millis(100)));
}

/// A page from anywhere may have the browser send a form to any port, and what is in it is up to the page.
#[test]
fn a_browser_gives_no_commands() {
    let (_folder, arm) = arm();
    for start in ["GET", "HEAD", "POST", "OPTIONS"] {
        let mut browser = arm.client();
        // However it is cut.
        browser.send(&start[..2]);
        assert!(browser.hears_nothing_for(Duration::from_millis(20)));
        browser.send(format!(
            "{} / HTTP/1.1\r\nHost: 127.0.0.1:1337\r\nOrigin: http://example.org\r\n\r\nM550 Pevil\r\n",
            &start[2..]
        ));
        let reply = browser.reply();
        assert!(reply.contains("this is HTTP"), "{start}: {reply:?}");
        assert!(browser.is_closed(), "{start}");
        assert_eq!(
            arm.client().say("M550"),
            "ok MACHINENAME:line-us",
            "{start}"
        );
    }
    // Later in a connection they are words like any other.
    let mut client = arm.client();
    assert_eq!(client.say("M114"), HOME);
    assert_eq!(client.say("GET "), "error INFO:\"unknown command 'GET'\"");
}
