//! The air of a desktop: networks from a file, so that joining them can be tried without a radio.

use crate::boards::scripted_radio::{Air, MAX_ON_AIR, OnAir};
use crate::log::warning;
use embassy_time::Timer;
use protocol_core::wifi::Ssid;
use std::path::Path;
use std::{fs, io};

/// Time between two looks at the file, in milliseconds.
const LOOK_EVERY: u64 = 100;

/// The networks that a file names: a line each with name, password and strength in dBm, separated by tabs.
///
/// A line without a password is an open network; without a strength it has -50 dBm. Empty lines and those
/// that begin with `#` are none.
///
/// # Errors
/// With the number of the first line that is no network.
pub fn parse(text: &str) -> Result<Vec<OnAir>, String> {
    let mut networks = Vec::new();
    for (index, line) in text.lines().enumerate() {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let mut words = line.split('\t');
        let name = words.next().unwrap_or_default();
        let password = words.next().filter(|word| !word.is_empty());
        let strength = words.next().map_or(Ok(-50), str::parse);
        let network = strength
            .ok()
            .filter(|_| words.next().is_none())
            .and_then(|dbm| OnAir::new(name.as_bytes(), password.map(str::as_bytes), dbm));
        networks.push(network.ok_or_else(|| format!("line {} is no network", index + 1))?);
    }
    if networks.len() > MAX_ON_AIR {
        return Err(format!("there are more than {MAX_ON_AIR} networks"));
    }
    Ok(networks)
}

/// The networks of a file.
///
/// # Errors
/// When it cannot be read, or holds something else.
pub fn read(path: &Path) -> io::Result<Vec<OnAir>> {
    parse(&fs::read_to_string(path)?).map_err(io::Error::other)
}

/// Keeps the air as the file says, and looks at it again and again; a file that makes no sense is told once.
pub async fn follow(air: &Air, path: &Path) -> ! {
    let mut before = None;
    let mut present: Vec<Ssid> = Vec::new();
    loop {
        let text = fs::read_to_string(path).unwrap_or_default();
        if before.as_ref() != Some(&text) {
            match parse(&text) {
                Ok(networks) => {
                    for ssid in present.drain(..) {
                        if !networks.iter().any(|network| network.ssid == ssid) {
                            air.remove(&ssid);
                        }
                    }
                    present.extend(networks.iter().map(|network| network.ssid.clone()));
                    networks.into_iter().for_each(|network| air.put(network));
                }
                Err(error) => warning!("{}: {}", path.display(), error.as_str()),
            }
            before = Some(text);
        }
        Timer::after_millis(LOOK_EVERY).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_a_network() {
        let networks = parse("# at home\nhome\tcorrect horse\t-40\n\nopen\t\t-70\nother one\n");
        let on_air = |name: &str, password: Option<&str>, dbm| {
            OnAir::new(name.as_bytes(), password.map(str::as_bytes), dbm).unwrap()
        };
        let expected = [
            on_air("home", Some("correct horse"), -40),
            on_air("open", None, -70),
            on_air("other one", None, -50),
        ];
        assert_eq!(networks.unwrap(), expected);
    }

    #[test]
    fn what_is_no_network_is_named() {
        for line in [
            "\tcorrect horse",
            "home\tshort",
            "home\t\tloud",
            "home\t\t-40\tmore",
        ] {
            let error = parse(&format!("open\n{line}\n")).unwrap_err();
            assert_eq!(error, "line 2 is no network", "{line:?}");
        }
        let many = "open\n".repeat(MAX_ON_AIR + 1);
        assert_eq!(parse(&many).unwrap_err(), "there are more than 16 networks");
    }
}
