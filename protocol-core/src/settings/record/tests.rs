extern crate std;

use super::*;
use crate::arm::Angles;
use crate::drawings::Slot;
use crate::motion::Microdegrees;
use crate::wifi::{MAX_PASSWORD, MAX_SSID, Networks, Password, Ssid};
use proptest::array::{uniform3, uniform4};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use std::vec::Vec as StdVec;

fn networks() -> impl Strategy<Value = Networks> {
    let network = (
        vec(any::<u8>(), 1..=32),
        option::of(vec(any::<u8>(), 8..=63)),
    );
    vec(network, 0..=MAX_NETWORKS).prop_map(|list| {
        let mut networks = Networks::new();
        for (ssid, password) in list {
            let network = Network {
                ssid: Ssid::new(&ssid).unwrap(),
                password: password.map(|phrase| Password::new(&phrase).unwrap()),
            };
            networks.put(network).unwrap();
        }
        networks
    })
}

fn settings() -> impl Strategy<Value = Settings> {
    let button = any::<[u8; 2]>().prop_map(|[number, slot]| {
        let choice = ButtonDraws::from_bytes([number % 4, slot % 33]);
        choice.unwrap_or_default()
    });
    let numbers = (1..=4u8, 1..=2u8, any::<bool>(), button);
    let fitting = (uniform4(-500..=500i16), -200..=200i16, 0..8u8);
    let origin = prop_oneof!["", "\\*", "https?://[a-z0-9.-]{1,40}(:[0-9]{1,5})?"];
    let address = option::of("http://[a-z0-9]{1,20}(:[1-9][0-9]{0,3})?/[a-z0-9._/-]{0,60}");
    (
        "[A-Za-z0-9]([A-Za-z0-9-]{0,30}[A-Za-z0-9])?",
        uniform3(any::<i32>()),
        networks(),
        numbers,
        (
            option::of(vec(any::<u8>(), 8..=63)),
            fitting,
            origin,
            address,
        ),
    )
        .prop_map(
            |(
                name,
                offsets,
                networks,
                (start, access_point, waves, button),
                (own, (map, shift, servos), origin, address),
            )| {
                Settings {
                    name: MachineName::new(&name).unwrap(),
                    calibration: Calibration {
                        offsets: Angles::from_array(offsets.map(Microdegrees::new)),
                    },
                    networks,
                    start: StartMode::from_number(start).unwrap(),
                    access_point: AccessPointName::from_number(access_point).unwrap(),
                    own_password: own.map(|phrase| Password::new(&phrase).unwrap()),
                    waves,
                    button,
                    map: ZMap::new(map).unwrap(),
                    shift: NibShift::from_hundredths(shift).unwrap(),
                    directions: Directions::from_byte(servos).unwrap(),
                    allowed_origin: AllowedOrigin::new(&origin).unwrap(),
                    update_address: address.map(|text| ManifestAddress::new(&text).unwrap()),
                }
            },
        )
}

/// Where the fields of a good record begin.
fn fields(record: &[u8]) -> StdVec<usize> {
    let mut starts = StdVec::new();
    let mut at = 1;
    while at < record.len() {
        starts.push(at);
        at += 2 + usize::from(record[at + 1]);
    }
    assert_eq!(at, record.len());
    starts
}

proptest! {
    #[test]
    fn settings_survive_their_bytes(settings in settings()) {
        prop_assert_eq!(Settings::from_bytes(&settings.to_bytes()), Some(settings));
    }

    #[test]
    fn any_bytes_are_read_or_refused(bytes in vec(any::<u8>(), 0..1000)) {
        let _ = Settings::from_bytes(&bytes);
        let mut record = bytes;
        record.insert(0, VERSION);
        if let Some(settings) = Settings::from_bytes(&record) {
            prop_assert_eq!(Settings::from_bytes(&settings.to_bytes()), Some(settings));
        }
    }

    #[test]
    fn a_wrong_byte_never_panics(settings in settings(), at: prop::sample::Index, with: u8) {
        let mut record = settings.to_bytes();
        let at = at.index(record.len());
        record[at] = with;
        let _ = Settings::from_bytes(&record);
    }

    #[test]
    fn a_record_cut_short_is_none_or_has_whole_fields(settings in settings(), at: prop::sample::Index) {
        let record = settings.to_bytes();
        let length = at.index(record.len());
        let whole = length > 0 && (length == 1 || fields(&record).contains(&length));
        prop_assert_eq!(Settings::from_bytes(&record[..length]).is_some(), whole);
    }

    #[test]
    fn tags_of_later_firmware_are_skipped(
        settings in settings(),
        tag in 100..=255u8,
        value in vec(any::<u8>(), 0..=255),
        place: prop::sample::Index,
    ) {
        let record = settings.to_bytes();
        let mut places = fields(&record);
        places.push(record.len());
        let at = places[place.index(places.len())];
        let mut longer = record[..at].to_vec();
        longer.extend([tag, value.len() as u8]);
        longer.extend(&value);
        longer.extend(&record[at..]);
        prop_assert_eq!(Settings::from_bytes(&longer), Some(settings));
    }

    #[test]
    fn what_an_older_record_does_not_have_is_default(settings in settings()) {
        // A record of name and calibration alone.
        let record = settings.to_bytes();
        let end = fields(&record)[2];
        let expected = Settings {
            name: settings.name,
            calibration: settings.calibration,
            ..Settings::default()
        };
        prop_assert_eq!(Settings::from_bytes(&record[..end]), Some(expected));
    }
}

#[test]
fn the_bytes_of_a_record() {
    let record = b"\x02\
        \x01\x0brobs-lineus\
        \x02\x0c\x01\0\0\0\xfe\xff\xff\xff\x03\0\0\0\
        \x03\x12\x04homecorrect horse\
        \x03\x05\x04open\
        \x04\x01\x04\
        \x05\x01\x02\
        \x06\x01\x00\
        \x07\x08\x00\xffsecret\
        \x10\x02\x02\x07\
        \x18\x08\0\0\x64\0\x2c\x01\x38\xff\
        \x19\x02\xab\xff\
        \x1a\x01\x02\
        \x08\x13https://example.org\
        \x20\x0ahttp://a/b";
    let settings = Settings::from_bytes(record).unwrap();
    assert_eq!(settings.to_bytes(), record);
    assert_eq!(settings.name.as_str(), "robs-lineus");
    let offsets = settings.calibration.offsets.to_array();
    assert_eq!(offsets.map(Microdegrees::get), [1, -2, 3]);
    let ssids: StdVec<&[u8]> = settings
        .networks
        .iter()
        .map(|network| network.ssid.as_bytes())
        .collect();
    assert_eq!(ssids, [&b"home"[..], b"open"]);
    assert_eq!(settings.start, StartMode::StationLongPress);
    assert_eq!(settings.access_point, AccessPointName::Machine);
    assert!(!settings.waves);
    let address = settings.update_address.as_ref().unwrap();
    assert_eq!(address.as_str(), "http://a/b");
    assert_eq!(settings.button, ButtonDraws::Always(Slot::new(7).unwrap()));
    let password = settings.own_password.as_ref().unwrap();
    assert_eq!(password.as_bytes(), b"\x00\xffsecret");
    assert_eq!(settings.map.corners(), [0, 100, 300, -200]);
    assert_eq!(settings.shift.hundredths(), -85);
    assert_eq!(settings.directions.reversed, [false, true, false]);
    assert_eq!(settings.allowed_origin.as_str(), "https://example.org");
}

#[test]
fn the_longest_record_fits_exactly() {
    let mut settings = Settings {
        name: MachineName::new("abcdefghijklmnopqrstuvwxyz012345").unwrap(),
        update_address: ManifestAddress::new(&std::format!("http://a/{:x<87}", "")),
        own_password: Password::new(&[0xff; MAX_PASSWORD]),
        allowed_origin: AllowedOrigin::new(&std::format!("http://{}", "x".repeat(MAX_ORIGIN - 7)))
            .unwrap(),
        ..Settings::default()
    };
    for number in 0..MAX_NETWORKS {
        let network = Network {
            ssid: Ssid::new(&[number as u8; MAX_SSID]).unwrap(),
            password: Password::new(&[0xff; MAX_PASSWORD]),
        };
        settings.networks.put(network).unwrap();
    }
    let record = settings.to_bytes();
    assert_eq!(record.len(), MAX_RECORD);
    assert_eq!(Settings::from_bytes(&record), Some(settings));
}

#[test]
fn a_later_version_is_not_taken() {
    let mut record = Settings::default().to_bytes();
    record[0] = VERSION + 1;
    assert_eq!(Settings::from_bytes(&record), None);
    for record in [&[][..], &[0], &[1], &[0xff; 40], &[0; 40]] {
        assert_eq!(Settings::from_bytes(record), None, "{record:?}");
    }
}

#[test]
fn a_value_that_cannot_be_leaves_the_others() {
    let expected = Settings {
        waves: false,
        ..Settings::default()
    };
    for field in [
        &b"\x01\x00"[..],
        b"\x01\x02-a",
        b"\x01\x01\xff",
        b"\x02\x0b12345678901",
        b"\x03\x00",
        b"\x03\x01\x00",
        b"\x03\x03\x01ax",
        b"\x04\x01\x00",
        b"\x04\x01\x05",
        b"\x04\x02\x01\x01",
        b"\x05\x01\x03",
        b"\x06\x01\x02",
        b"\x06\x00",
        b"\x07\x00",
        b"\x07\x07seven..",
        b"\x18\x07\0\0\0\0\0\0\0",
        b"\x18\x08\0\0\0\0\0\0\xf5\x01",
        b"\x19\x02\xc9\x00",
        b"\x19\x01\x00",
        b"\x1a\x01\x08",
        b"\x08\x04null",
        b"\x08\x01\xff",
        b"\x20\x00",
        b"\x20\x03ftp",
    ] {
        let record = [&[VERSION], field, b"\x06\x01\x00"].concat();
        assert_eq!(
            Settings::from_bytes(&record).as_ref(),
            Some(&expected),
            "{field:?}"
        );
    }
}
