//! The port itself: who gets the banner, and when it is there.

use host_tests::desktop::serial::{SerialPort, with_serial_tcp};
use host_tests::desktop::{Desktop, wait_until};
use protocol_core::lasaur::BANNER;
use std::fs;
use std::os::unix::fs::symlink;
use std::time::Duration;

#[test]
fn every_connection_gets_the_banner_and_a_fresh_session() {
    let folder = tempfile::tempdir().unwrap();
    let (_arm, address, mut port) = with_serial_tcp(folder.path(), &["--speed", "50"]);
    assert_eq!(port.say("G91"), "");
    assert_eq!(port.say("G10L2P0X20Y20"), "");
    drop(port);
    let mut port = SerialPort::connect(address);
    assert_eq!(port.line(), BANNER.trim_end());
    // Absolute, from the default offset.
    assert_eq!(port.say("G0X1Y2"), "");
    port.wait_for_place("X6.000Y7.000V");
}

#[test]
fn a_terminal_is_a_port_as_long_as_the_arm_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tty");
    let arguments = ["--serial", path.to_str().unwrap(), "--speed", "50"];
    // A link that an arm without power has left there.
    symlink("/dev/pts/none", &path).unwrap();
    let arm = Desktop::start(folder.path(), &arguments);
    for (opened, x) in ["1", "2"].into_iter().enumerate() {
        wait_until("the port to be free", || {
            arm.count("serial port closed") == opened
        });
        let mut port = SerialPort::open(&path);
        assert_eq!(port.line(), BANNER.trim_end());
        assert_eq!(port.say(&format!("G0X{x}Y0")), "");
        port.wait_for_place(&format!("X{}.000Y5.000V", x.parse::<i32>().unwrap() + 5));
        // Nothing of what is sent comes back as an echo.
        assert!(port.hears_nothing_for(Duration::from_millis(20)));
    }
    arm.stop();
    assert!(
        fs::symlink_metadata(&path).is_err(),
        "the link is still there"
    );
}

#[test]
fn what_is_no_link_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("letter");
    fs::write(&path, "precious").unwrap();
    let run = std::process::Command::new(host_tests::desktop::binary())
        .args(["--line-us", "127.0.0.1:0", "--serial"])
        .arg(&path)
        .arg("--state")
        .arg(folder.path().join("state"))
        .output()
        .unwrap();
    assert!(!run.status.success());
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(said.contains("letter"), "{said}");
    assert_eq!(fs::read_to_string(&path).unwrap(), "precious");
}
