//! What is told and what can be changed.

use super::arm;
use flate2::read::GzDecoder;
use host_tests::desktop::{Desktop, Web, wait_until};
use serde_json::json;
use std::io::Read;

#[test]
fn the_machine_and_its_state() {
    let (arm, _folder) = arm(&[]);
    let web = arm.web();
    wait_until("the network", || web.state()["light"] == "blue");
    let machine = web.get("/api").json();
    assert_eq!(machine["name"], "line-us");
    assert_eq!(machine["home"], json!({"x": 1000, "y": 1000, "z": 1000}));
    assert_eq!(machine["limits"]["drawing"], 65535);
    let state = web.state();
    for (field, expected) in [
        ("name", json!("line-us")),
        ("light", json!("blue")),
        ("position", json!({"x": 1000, "y": 1000, "z": 1000})),
        ("pen", json!("up")),
        ("moving", json!(false)),
        ("speed", json!({"pen_down": 5, "pen_up": 15})),
        ("calibrated", json!(false)),
        ("clients", json!(0)),
        ("addresses", json!([arm.address().ip().to_string()])),
        ("problems", json!([])),
        ("job", json!(null)),
    ] {
        assert_eq!(state[field], expected, "{field}");
    }
    assert_eq!(state["wifi"]["phase"], "connected");
    let _client = arm.client();
    assert_eq!(web.state()["clients"], 1);
}

#[test]
fn the_page_is_compressed_and_asked_for_once() {
    let (arm, _folder) = arm(&[]);
    let web = arm.web();
    let page = web.get("/");
    assert_eq!(
        page.header("content-type"),
        Some("text/html; charset=utf-8")
    );
    assert_eq!(page.header("content-encoding"), Some("gzip"));
    let policy = page.header("content-security-policy").unwrap();
    assert!(policy.starts_with("default-src 'none';"), "{policy}");
    let mut text = String::new();
    GzDecoder::new(&page.body[..])
        .read_to_string(&mut text)
        .unwrap();
    assert!(text.starts_with("<!doctype html>"), "{text:.100}");
    let length = page.body.len().to_string();
    let tag = page.header("etag").unwrap();

    let head = web.request("HEAD", "/", "", b"");
    assert_eq!((head.status, head.body.len()), (200, 0));
    assert_eq!(head.header("content-length"), Some(length.as_str()));
    let again = web.request("GET", "/", &format!("If-None-Match: {tag}\r\n"), b"");
    assert_eq!((again.status, again.body.len()), (304, 0));
}

#[test]
fn moves_by_hand() {
    let (arm, _folder) = arm(&["--speed", "max"]);
    let web = arm.web();
    let place = |x, y, z| json!({"x": x, "y": y, "z": z, "note": null});
    assert_eq!(
        web.done("/api/jog", r#"{"x":-50,"y":20}"#),
        place(950, 1020, 1000)
    );
    assert_eq!(
        web.done("/api/move", r#"{"x":1200,"y":0,"z":0}"#),
        place(1200, 0, 0)
    );
    let far = web.done("/api/move", r#"{"x":5000,"y":0,"z":0}"#);
    assert_eq!(
        far["note"],
        "out of reach: going to the closest point, pen lifted"
    );
    assert_eq!(
        (far["x"].as_i64(), far["z"].as_i64()),
        (Some(1950), Some(1000))
    );
    assert_eq!(web.done("/api/home", ""), place(1000, 1000, 1000));
    arm.client().wait_for_place("ok X:1000 Y:1000 Z:1000");
    for (path, body, error) in [
        ("/api/jog", r#"{"x":501}"#, "bad_value"),
        ("/api/jog", r#"{"q":1}"#, "bad_json"),
        ("/api/jog", r#"{"x":1.5}"#, "bad_json"),
        ("/api/jog", r#"{"x":99999999999}"#, "bad_json"),
        ("/api/jog", "", "bad_json"),
        ("/api/jog", r#"{"x":1} {"#, "bad_json"),
        ("/api/move", r#"{"x":1000001}"#, "bad_value"),
    ] {
        let answer = web.post(path, body);
        assert_eq!(answer.error(), (400, error.to_string()), "{path} {body}");
        assert!(
            answer.json()["message"]
                .as_str()
                .is_some_and(|text| !text.is_empty())
        );
    }
    assert_eq!(
        web.state()["position"],
        json!({"x": 1000, "y": 1000, "z": 1000})
    );
}

#[test]
fn calibration() {
    let (arm, _folder) = arm(&["--speed", "max"]);
    let web = arm.web();
    web.done("/api/jog", r#"{"x":30,"y":-20}"#);
    let home = json!({"x": 1000, "y": 1000, "z": 1000});
    assert_eq!(web.done("/api/calibration", ""), home);
    assert_eq!(web.state()["calibrated"], true);
    let cleared = web.request("DELETE", "/api/calibration", "", b"").json();
    assert_eq!(cleared, json!({"x": 1030, "y": 980, "z": 1000}));
    assert_eq!(web.state()["calibrated"], false);
}

#[test]
fn settings_are_changed_together_or_not_at_all_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let arm = Desktop::start(folder.path(), &[]);
    let web = arm.web();
    let before = json!({
        "name": "line-us", "speed": {"pen_down": 5, "pen_up": 15}, "waves": true,
        "start_mode": "station", "access_point_name": "setup", "allowed_origin": null,
    });
    assert_eq!(web.get("/api/settings").json(), before);
    let patch = |body: &str| web.request("PATCH", "/api/settings", "", body.as_bytes());
    for (body, error, about) in [
        (
            r#"{"waves":false,"name":"a b"}"#,
            "bad_value",
            "name is 'a b'",
        ),
        (
            r#"{"waves":false,"speed":{"pen_down":31}}"#,
            "bad_value",
            "speed.pen_down may be 1 to 30",
        ),
        (
            r#"{"waves":false,"start_mode":"sation"}"#,
            "bad_value",
            "start_mode is 'sation'",
        ),
        (
            r#"{"waves":false,"allowed_origin":"example.org"}"#,
            "bad_value",
            "allowed_origin is",
        ),
        (r#"{"waves":false,"wifes":true}"#, "bad_json", ""),
        (r#"{"waves":1}"#, "bad_json", ""),
        (r#"[]"#, "bad_json", ""),
    ] {
        let answer = patch(body);
        assert_eq!(answer.error(), (400, error.to_string()), "{body}");
        let message = answer.json()["message"].as_str().unwrap().to_owned();
        assert!(message.contains(about), "{body}: {message}");
    }
    assert_eq!(web.get("/api/settings").json(), before);

    let after = json!({
        "name": "robs-lineus", "speed": {"pen_down": 4, "pen_up": 20}, "waves": false,
        "start_mode": "station_long_press", "access_point_name": "machine",
        "allowed_origin": "https://example.org",
    });
    let answer = patch(&after.to_string());
    assert_eq!((answer.status, answer.json()), (200, after.clone()));
    assert_eq!(arm.client().say("M550"), "ok MACHINENAME:robs-lineus");
    arm.stop();

    let arm = Desktop::start(folder.path(), &[]);
    let web = arm.web();
    let mut kept = after;
    // The speed is not kept, as with G94.
    kept["speed"] = before["speed"].clone();
    assert_eq!(web.get("/api/settings").json(), kept);
    let cleared = web.request("PATCH", "/api/settings", "", br#"{"allowed_origin":null}"#);
    assert_eq!(cleared.json()["allowed_origin"], json!(null));
}

#[test]
fn networks_and_no_password_anywhere() {
    let (arm, _folder) = arm(&[]);
    let web = arm.web();
    let secret = "correct horse";
    let added = web.done(
        "/api/networks",
        &json!({"name": "caf\u{e9} \"1\"", "password": secret}).to_string(),
    );
    assert_eq!(added, json!({"trying": false}));
    web.done("/api/networks", r#"{"name":"open"}"#);
    let networks = web.get("/api/networks");
    let listed: Vec<(String, bool)> = networks.json()["networks"]
        .as_array()
        .unwrap()
        .iter()
        .map(|network| {
            (
                network["name"].as_str().unwrap().to_owned(),
                network["remembered"].as_bool().unwrap(),
            )
        })
        .collect();
    let names = ["this computer's", "caf\u{e9} \"1\"", "open"];
    assert_eq!(listed, names.map(|name| (name.to_owned(), true)));
    for (body, error) in [
        (r#"{"name":"home","password":"short"}"#, "bad_value"),
        (r#"{"name":""}"#, "bad_value"),
        (r#"{"password":"correct horse"}"#, "bad_json"),
    ] {
        assert_eq!(
            web.post("/api/networks", body).error(),
            (400, error.to_string()),
            "{body}"
        );
    }
    for path in [
        "/api",
        "/api/state",
        "/api/settings",
        "/api/networks",
        "/api/job/drawing",
    ] {
        let told = String::from_utf8_lossy(&web.get(path).body).into_owned();
        assert!(!told.contains("horse"), "{path}: {told}");
    }
    web.done("/api/networks/forget", r#"{"name":"open"}"#);
    let again = web.post("/api/networks/forget", r#"{"name":"open"}"#);
    assert_eq!(again.error(), (400, "bad_value".into()));
}

#[test]
fn pages_from_elsewhere_are_kept_out_unless_the_owner_allows_them() {
    let (arm, _folder) = arm(&[]);
    let web = arm.web();
    let ask = |web: Web, method, path, origin: &str| {
        web.request(method, path, &format!("Origin: {origin}\r\n"), b"")
    };
    let own = format!("http://{}", web.address());
    let elsewhere = "https://example.org";
    assert_eq!(ask(web, "POST", "/api/home", &own).status, 200);
    let refused = ask(web, "POST", "/api/home", elsewhere);
    assert_eq!(refused.error(), (403, "foreign_origin".into()));
    assert_eq!(refused.header("access-control-allow-origin"), None);
    assert_eq!(ask(web, "POST", "/api/home", "null").status, 403);
    assert_eq!(ask(web, "OPTIONS", "/api/home", elsewhere).status, 403);

    let allow = json!({"allowed_origin": elsewhere}).to_string();
    assert_eq!(
        web.request("PATCH", "/api/settings", "", allow.as_bytes())
            .status,
        200
    );
    let allowed = ask(web, "POST", "/api/home", elsewhere);
    assert_eq!(allowed.status, 200);
    assert_eq!(
        allowed.header("access-control-allow-origin"),
        Some(elsewhere)
    );
    let preflight = ask(web, "OPTIONS", "/api/settings", elsewhere);
    assert_eq!(preflight.status, 204);
    let methods = preflight.header("access-control-allow-methods").unwrap();
    assert!(methods.contains("PATCH"), "{methods}");
    assert_eq!(
        ask(web, "POST", "/api/home", "https://example.com").status,
        403
    );
}

#[test]
fn a_name_elsewhere_that_points_here_does_not_help() {
    let (arm, _folder) = arm(&[]);
    let web = arm.web();
    let ask = |host: &str| {
        let head = format!("GET /api/state HTTP/1.1\r\nHost: {host}\r\n\r\n");
        String::from_utf8(web.raw(head.as_bytes())).unwrap()
    };
    for host in [
        "line-us.local",
        "LINE-US.local:80",
        "line-us",
        "localhost:8080",
        "10.0.0.7",
    ] {
        assert!(
            ask(host).starts_with("HTTP/1.1 200 "),
            "{host}: {}",
            ask(host)
        );
    }
    for host in ["example.org", "line-us.example.org", "other.local"] {
        assert!(
            ask(host).starts_with("HTTP/1.1 421 "),
            "{host}: {}",
            ask(host)
        );
    }
}

#[test]
fn what_is_not_there() {
    let (arm, _folder) = arm(&[]);
    let web = arm.web();
    for (method, path, error) in [
        ("GET", "/nothing", (404, "not_found")),
        ("GET", "/api/", (404, "not_found")),
        ("GET", "/../etc/passwd", (404, "not_found")),
        ("PUT", "/api/settings", (405, "bad_method")),
        ("GET", "/api/jog", (405, "bad_method")),
        ("GET", "/api/live", (426, "websocket_only")),
        ("GET", "/api/job/drawing", (404, "not_found")),
        ("POST", "/api/job/pause", (409, "no_job")),
        ("POST", "/api/job/stop", (409, "no_job")),
        ("POST", "/api/job/more?id=1&at=0", (409, "no_job")),
        ("POST", "/api/job/more", (400, "bad_value")),
        ("POST", "/api/job", (400, "bad_value")),
    ] {
        let (status, word) = error;
        let answer = web.request(method, path, "", b"");
        assert_eq!(answer.error(), (status, word.to_owned()), "{method} {path}");
    }
}

#[test]
fn firmware_where_there_is_no_place_for_it() {
    let (desktop, _folder) = arm(&[]);
    let web = desktop.web();
    // All of it is taken before the answer, so that a browser hears it.
    for body in [String::new(), "no manifest".into(), "x".repeat(300_000)] {
        let answer = web.post("/api/update", &body);
        assert_eq!(answer.error(), (422, "refused_update".into()));
        let message = answer.json()["message"].clone();
        assert_eq!(message, "this board has no place for another firmware");
    }
    assert_eq!(web.get("/api").json()["update_key"], "development");
    let update = web.get("/api/state").json()["update"].clone();
    let expected = json!({"phase": "idle", "version": null, "percent": null, "words": "none"});
    assert_eq!(update, expected);
}
