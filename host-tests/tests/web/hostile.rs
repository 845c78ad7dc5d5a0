//! Clients that break every rule, while the arm draws: each is answered or closed, and the drawing is as if
//! they were not there.

use super::arm;
use host_tests::desktop::{Desktop, Motion, wait_until};
use std::io::{Read, Write};

/// The status of an answer, 0 where the connection was closed without one.
fn status(answer: &[u8]) -> u16 {
    let text = String::from_utf8_lossy(answer);
    let status = text
        .strip_prefix("HTTP/1.1 ")
        .and_then(|rest| rest.get(..3));
    status.map_or(0, |status| status.parse().unwrap())
}

#[test]
fn requests_that_are_wrong_are_answered() {
    let (arm, _folder) = arm(&[]);
    let web = arm.web();
    let long = format!("GET / HTTP/1.1\r\nX: {}\r\n\r\n", "x".repeat(10_000));
    let many = format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(40));
    let path = format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(1900));
    let body = format!(
        "POST /api/jog HTTP/1.1\r\nContent-Length: 513\r\n\r\n{}",
        "x".repeat(513)
    );
    let deep = format!(
        "POST /api/jog HTTP/1.1\r\nContent-Length: 500\r\n\r\n{}",
        "[".repeat(500)
    );
    for (request, expected) in [
        (
            &b"\x16\x03\x01\x02\0\x01\0\x01\xfc\x03\x03\r\n\r\n"[..],
            400,
        ),
        (b"hello\r\n\r\n", 400),
        (b"GET / HTTP/9.9\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nbroken\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nA: \xff\0\r\n\r\n", 400),
        (long.as_bytes(), 431),
        (many.as_bytes(), 431),
        (path.as_bytes(), 404),
        (b"POST /api/jog HTTP/1.1\r\nContent-Length: -5\r\n\r\n", 400),
        (b"POST /api/jog HTTP/1.1\r\nContent-Length: 5x\r\n\r\n", 400),
        (
            b"POST /api/jog HTTP/1.1\r\nContent-Length: 18446744073709551615\r\n\r\n",
            413,
        ),
        (
            b"POST /api/job HTTP/1.1\r\nContent-Length: 4294967295\r\n\r\n",
            413,
        ),
        (
            b"POST /api/jog HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nxx",
            400,
        ),
        (
            b"POST /api/jog HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n",
            411,
        ),
        (body.as_bytes(), 413),
        (deep.as_bytes(), 400),
        (
            b"POST /api/jog HTTP/1.1\r\nContent-Length: 5\r\n\r\n\xff\xfe\xfd\xfc\xfb",
            400,
        ),
        (
            b"POST /api/jog HTTP/1.1\r\nContent-Length: 9\r\n\r\n{\"x\":\"\\ud",
            400,
        ),
        (
            b"GET / HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n",
            400,
        ),
    ] {
        let answer = web.raw(request);
        let text = String::from_utf8_lossy(request);
        assert_eq!(status(&answer), expected, "{text:.80}");
    }
    assert_eq!(web.state()["position"]["x"], 1000);
}

#[test]
fn requests_that_end_too_early_or_never_are_closed() {
    let (arm, _folder) = arm(&[]);
    let web = arm.web();
    let said = |bytes: &[u8]| {
        let mut stream = web.connect();
        stream.write_all(bytes).unwrap();
        stream
    };
    // Half-closed in the middle of the head, and of the body.
    let early = [
        (said(b"GET / HTT"), 0),
        (
            said(b"POST /api/jog HTTP/1.1\r\nContent-Length: 9\r\n\r\n{"),
            400,
        ),
    ];
    for (mut stream, expected) in early {
        stream.shutdown(std::net::Shutdown::Write).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        assert_eq!(status(&answer), expected);
    }
    // Silent for ever: in the head, in the body, from the beginning.
    let silent = [
        (said(b"GET / HTTP/1.1\r\nHost: "), 408),
        (
            said(b"POST /api/job HTTP/1.1\r\nContent-Length: 9\r\n\r\nG28"),
            408,
        ),
        (said(b""), 0),
    ];
    for (mut stream, expected) in silent {
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        assert_eq!(status(&answer), expected);
    }
    assert_eq!(web.job_state(), "");
}

#[test]
fn frames_that_are_wrong_end_the_connection_with_the_reason() {
    let (arm, _folder) = arm(&[]);
    let huge = [&[0x81, 0xff][..], &[0x7f; 8], &[0; 4]].concat();
    for (frames, code) in [
        (&b"\x81\x03G28"[..], 1002),
        (b"\x82\x83\0\0\0\0G28", 1003),
        (b"\x80\x80\0\0\0\0", 1002),
        (b"\x01\x81\0\0\0\0a\x81\x81\0\0\0\0b", 1002),
        (b"\xf1\x80\0\0\0\0", 1002),
        (b"\x83\x80\0\0\0\0", 1002),
        (b"\x89\xfe\0\xff\0\0\0\0", 1002),
        (&huge, 1009),
    ] {
        for path in ["/", "/api/live"] {
            let mut socket = arm.web().web_socket(path);
            socket.message();
            socket.stream().write_all(frames).unwrap();
            let close = loop {
                match socket.anything() {
                    tungstenite::Message::Close(frame) => break frame,
                    _ => continue,
                }
            };
            let found = close.map(|frame| u16::from(frame.code));
            assert_eq!(found, Some(code), "{path} {frames:x?}");
        }
    }
}

#[test]
fn a_crowd_does_not_disturb_a_drawing() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("trace.csv");
    let arm = Desktop::start(
        folder.path(),
        &["--speed", "5", "--trace", &trace.to_string_lossy()],
    );
    let web = arm.web();
    let text =
        "G01 X1200 Y0\nG01 Z0\nG01 X1500\nG01 Y300\nG01 X1200\nG01 Y0\nG01 Z1000\n".repeat(4);
    assert_eq!(web.done("/api/job", &text)["state"], "drawing");
    let memory = arm.memory_kb();
    for _ in 0..3 {
        web.crowd(50);
    }
    wait_until("the end of the drawing", || web.job_state() == "done");
    let grown = arm.memory_kb().saturating_sub(memory);
    assert!(grown < 10_000, "{grown} kB more than before");
    arm.stop();

    Motion::of(&trace).assert_is(&Motion::of_a_client(&text));
}
