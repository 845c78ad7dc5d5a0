//! The WebSocket of the original, and the live state.

use super::arm;
use serde_json::Value;
use tungstenite::{Error, Message};

#[test]
fn a_command_a_message() {
    let (arm, _folder) = arm(&["--speed", "max"]);
    let mut socket = arm.web().web_socket("/");
    assert!(socket.message().starts_with("hello VERSION:"));
    assert_eq!(socket.say("G54 X100 Y0 S2"), "ok ");
    assert_eq!(socket.say("G01 X500 Y0"), "ok X:1100 Y:0 Z:1000");
    assert_eq!(socket.say("G28\r\n"), "ok X:1000 Y:1000 Z:1000");
    assert_eq!(
        socket.say("undefined"),
        "error INFO:\"unknown command 'undefined'\""
    );
    assert_eq!(
        socket.say(&"x".repeat(3000)),
        "error INFO:\"line longer than 256 bytes\""
    );
    for code in ["M170", "M171", "M587", "M588"] {
        let refused = format!("error INFO:\"{code} is refused over the WebSocket\"");
        assert_eq!(
            socket.say(&format!("{code} S\"home\" P\"correct horse\"")),
            refused
        );
    }
    // Several in one message, and none: an empty one is not answered.
    socket.send(Message::text("G94 S5\nM114"));
    assert_eq!(socket.message(), "ok ");
    socket.message();
    socket.send(Message::text(""));
    socket.send(Message::Ping("there?".into()));
    assert_eq!(socket.anything(), Message::Pong("there?".into()));
    // Scale and origin belong to one connection.
    let mut other = arm.web().web_socket("/");
    other.message();
    assert_eq!(other.say("G01 X1200 Y0"), "ok X:1200 Y:0 Z:1000");
}

#[test]
fn the_pen_is_lifted_when_the_client_dies() {
    let (arm, _folder) = arm(&["--speed", "max", "--lift-after", "0"]);
    let mut socket = arm.web().web_socket("/");
    socket.message();
    socket.say("G01 X1200 Y0");
    socket.say("G01 Z0");
    socket.die();
    arm.client().wait_for_place("ok X:1200 Y:0 Z:1000");
}

#[test]
fn three_websockets_and_a_place_for_requests() {
    let (arm, _folder) = arm(&[]);
    let web = arm.web();
    let mut sockets: Vec<_> = (0..3).map(|_| web.web_socket("/api/live")).collect();
    for socket in &mut sockets {
        socket.message();
    }
    for path in ["/", "/api/live"] {
        match web.try_web_socket(path).map(drop) {
            Err(Error::Http(answer)) => assert_eq!(answer.status().as_u16(), 503),
            other => panic!("a fourth WebSocket: {other:?}"),
        }
        assert_eq!(web.state()["name"], "line-us");
    }
    sockets.pop();
    // The arm hears of it in its own time.
    host_tests::desktop::wait_until("a place", || web.try_web_socket("/").is_ok());
}

#[test]
fn the_state_and_the_pen_are_pushed() {
    let (arm, _folder) = arm(&[]);
    let mut socket = arm.web().web_socket("/api/live");
    let next = |socket: &mut host_tests::desktop::WebSocket| -> Value {
        serde_json::from_str(&socket.message()).unwrap()
    };
    let first = next(&mut socket);
    assert_eq!(first["state"]["position"]["x"], 1000);
    let mut client = arm.client();
    client.say("G01 X1200 Y900");
    let (mut trail, mut told_of_client) = (Vec::new(), false);
    loop {
        let message = next(&mut socket);
        told_of_client |= message["state"]["clients"] == 1;
        if let Some(places) = message["pen"]["trail"].as_array() {
            assert!(places.len() <= 8, "{places:?}");
            trail.extend(places.iter().map(|place| place[0].as_i64().unwrap()));
            if message["pen"]["moving"] == false {
                break;
            }
        }
    }
    assert!(told_of_client);
    assert!(trail.is_sorted() && trail.len() >= 3, "{trail:?}");
    assert_eq!(trail.last(), Some(&1200));
    // A new name is a new state.
    client.say("M550 Probs-lineus");
    while next(&mut socket)["state"]["name"] != "robs-lineus" {}
}
