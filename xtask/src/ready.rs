//! Ready-made arms: the settings that a freshly flashed arm finds.

use anyhow::{Context, Result, ensure};
use firmware::boards::desktop::imprint::imprint;
use protocol_core::settings::{MAX_NAME, MachineName, Settings};
use protocol_core::wifi::{MAX_PASSWORD, MAX_SSID, MIN_PASSWORD, Network, Password, Ssid};
use std::ffi::OsString;
use std::fs;
use std::ops::Range;
use std::path::PathBuf;

/// What the arm is to remember when it first starts.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Owner {
    /// The network that the arm joins by itself; an open one unless there is a password
    #[arg(long, value_name = "SSID")]
    pub network: Option<OsString>,
    /// A file with the network's password; a newline at its end does not count
    #[arg(long, value_name = "FILE", requires = "network")]
    pub password_file: Option<PathBuf>,
    /// The machine's name
    #[arg(long)]
    pub name: Option<String>,
}

impl Owner {
    /// The settings; `None` if nothing was asked for.
    ///
    /// # Errors
    /// When something cannot be: the message says what, and does not show the password.
    pub fn settings(&self) -> Result<Option<Settings>> {
        if self.network.is_none() && self.name.is_none() {
            return Ok(None);
        }
        let mut settings = Settings::default();
        if let Some(name) = &self.name {
            settings.name = MachineName::new(name).with_context(|| {
                format!("'{name}' is no machine name: 1 to {MAX_NAME} letters, digits and hyphens, with no hyphen at either end")
            })?;
        }
        if let Some(network) = self.network()? {
            settings
                .networks
                .put(network)
                .ok()
                .context("there is no room for a network")?;
        }
        Ok(Some(settings))
    }

    fn network(&self) -> Result<Option<Network>> {
        let Some(name) = &self.network else {
            return Ok(None);
        };
        let bytes = name.as_encoded_bytes();
        let ssid = Ssid::new(bytes).with_context(|| {
            format!(
                "{} is no network name: it has {} bytes, and they have 1 to {MAX_SSID}",
                name.display(),
                bytes.len()
            )
        })?;
        let password = match &self.password_file {
            None => None,
            Some(file) => {
                let text = fs::read(file).with_context(|| file.display().to_string())?;
                let phrase = text.strip_suffix(b"\n").unwrap_or(&text);
                let phrase = phrase.strip_suffix(b"\r").unwrap_or(phrase);
                Some(Password::new(phrase).with_context(|| {
                    format!(
                        "{}: the password has {} bytes, and they have {MIN_PASSWORD} to {MAX_PASSWORD}",
                        file.display(),
                        phrase.len()
                    )
                })?)
            }
        };
        Ok(Some(Network { ssid, password }))
    }
}

/// Puts settings into the image of a flash, in the partition of that name in the table (`partitions.csv`).
///
/// # Errors
/// When the table does not have it, or when something else is there.
pub fn put_into(image: &mut Vec<u8>, settings: &Settings, table: &str) -> Result<()> {
    let bytes = imprint(settings).context("the settings do not fit into a flash")?;
    let place = partition(table, "settings").context("no partition for the settings")?;
    ensure!(
        place.len() == bytes.len(),
        "the partition for the settings has {} bytes instead of {}",
        place.len(),
        bytes.len()
    );
    if image.len() < place.end {
        image.resize(place.end, 0xff);
    }
    let room = image.get_mut(place).context("the image is too long")?;
    ensure!(
        room.iter().all(|byte| *byte == 0xff),
        "the partition for the settings is taken"
    );
    room.copy_from_slice(&bytes);
    Ok(())
}

/// Where a partition is.
fn partition(table: &str, name: &str) -> Option<Range<usize>> {
    let row = table.lines().find_map(|row| {
        let mut fields = row.split(',').map(str::trim);
        (fields.next()? == name).then(|| fields.collect::<Vec<_>>())
    })?;
    let number = |text: &str| usize::from_str_radix(text.strip_prefix("0x")?, 16).ok();
    let [_, _, start, length] = row.as_slice() else {
        return None;
    };
    let start = number(start)?;
    Some(start..start + number(length)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::boards::SETTINGS;
    use firmware::boards::desktop::imprint::recall;
    use firmware::services::storage::MemoryHealth;
    use std::io::Write;
    use tempfile::NamedTempFile;

    const TABLE: &str = include_str!("../../firmware/partitions.csv");

    fn file(text: &[u8]) -> NamedTempFile {
        let mut file = NamedTempFile::new().unwrap();
        file.write_all(text).unwrap();
        file
    }

    fn owner(network: &str, password: Option<&NamedTempFile>, name: Option<&str>) -> Owner {
        Owner {
            network: Some(network.into()),
            password_file: password.map(|file| file.path().into()),
            name: name.map(Into::into),
        }
    }

    /// What an arm finds that is flashed with these settings behind a firmware of some size.
    fn found(owner: &Owner, firmware: usize) -> Settings {
        let mut image = vec![0x5a; firmware];
        let settings = owner.settings().unwrap().unwrap();
        put_into(&mut image, &settings, TABLE).unwrap();
        assert!(image[..firmware].iter().all(|byte| *byte == 0x5a));
        let place = SETTINGS.start as usize..SETTINGS.end as usize;
        assert!(
            image[firmware..place.start]
                .iter()
                .all(|byte| *byte == 0xff)
        );
        let (settings, health) = recall(image[place].to_vec()).unwrap();
        assert_eq!(health, MemoryHealth::Sound);
        settings
    }

    fn refusal(owner: &Owner) -> String {
        format!("{:#}", owner.settings().unwrap_err())
    }

    #[test]
    fn a_freshly_flashed_arm_finds_its_network_and_its_name() {
        for ending in ["", "\n", "\r\n"] {
            let password = file(format!("correct horse{ending}").as_bytes());
            let settings = found(
                &owner("my home", Some(&password), Some("robs-arm")),
                1_200_000,
            );
            assert_eq!(settings.name.as_str(), "robs-arm");
            let networks: Vec<_> = settings.networks.iter().collect();
            assert_eq!(networks.len(), 1);
            assert_eq!(networks[0].ssid.as_bytes(), b"my home");
            let phrase = networks[0].password.as_ref().unwrap();
            assert_eq!(phrase.as_bytes(), b"correct horse", "{ending:?}");
        }
    }

    #[test]
    fn without_a_password_the_network_is_open() {
        let settings = found(&owner("caf\u{e9}", None, None), 0);
        let expected = Network {
            ssid: Ssid::new("caf\u{e9}".as_bytes()).unwrap(),
            password: None,
        };
        assert_eq!(settings.networks.iter().next(), Some(&expected));
        assert_eq!(settings.name, MachineName::default());
    }

    #[test]
    fn a_newline_inside_a_password_counts() {
        let password = file(b"two\nlines\n\n");
        let settings = found(&owner("home", Some(&password), None), 0);
        let network = settings.networks.iter().next().unwrap();
        let phrase = network.password.as_ref().unwrap();
        assert_eq!(phrase.as_bytes(), b"two\nlines\n");
    }

    #[test]
    fn what_is_wrong_is_named() {
        assert!(refusal(&owner(&"x".repeat(33), None, None)).contains("it has 33 bytes"));
        assert!(refusal(&owner("", None, None)).contains("it has 0 bytes"));
        let name = refusal(&owner("home", None, Some("-arm")));
        assert!(name.starts_with("'-arm' is no machine name"), "{name}");
        let long = "p".repeat(64);
        for (text, length) in [("short", 5), ("", 0), ("\n", 0), (&long, 64)] {
            let password = file(text.as_bytes());
            let said = refusal(&owner("home", Some(&password), None));
            assert!(
                said.contains(&format!("the password has {length} bytes")),
                "{said}"
            );
            assert!(text.len() < 5 || !said.contains(text), "{said}");
        }
        let absent = Owner {
            network: Some("home".into()),
            password_file: Some("no-such-file".into()),
            name: None,
        };
        assert!(refusal(&absent).starts_with("no-such-file: "));
    }

    #[test]
    fn nothing_asked_for_is_nothing_written() {
        assert_eq!(Owner::default().settings().unwrap(), None);
    }

    #[test]
    fn the_place_comes_from_the_table() {
        let place = partition(TABLE, "settings").unwrap();
        assert_eq!(place, SETTINGS.start as usize..SETTINGS.end as usize);
        assert_eq!(partition(TABLE, "setting"), None);
        let mut taken = vec![0; SETTINGS.start as usize + 1];
        let said = put_into(&mut taken, &Settings::default(), TABLE).unwrap_err();
        assert!(said.to_string().contains("taken"), "{said}");
    }
}
