//! The boards: the only places with a chip's name in them.

#[cfg(feature = "desktop")]
pub mod desktop;
#[cfg(feature = "embassy-tcp")]
pub mod embassy_tcp;
#[cfg(feature = "embassy-tcp")]
pub mod embassy_udp;
#[cfg(feature = "esp")]
pub mod esp;
#[cfg(any(feature = "desktop", feature = "virt"))]
pub mod scripted_radio;
#[cfg(feature = "slots")]
pub mod slots;
#[cfg(feature = "virt")]
pub mod virt;

// Data of the ESP32 boards, one file each; `esp::data` explains it.
#[cfg(feature = "esp32")]
mod esp32;
#[cfg(feature = "esp32c3")]
mod esp32c3;
#[cfg(feature = "esp32c6")]
mod esp32c6;
#[cfg(feature = "esp32s3")]
mod esp32s3;

/// Where the settings are in a flash of 4 MB; `partitions.csv` is the whole layout.
pub const SETTINGS: core::ops::Range<u32> = 0x29_0000..0x29_8000;
/// Where the drawings are in it.
pub const DRAWINGS: core::ops::Range<u32> = 0x29_8000..0x40_0000;
/// Where it says which firmware starts.
pub const BOOT_CHOICE: core::ops::Range<u32> = 0x9000..0xb000;
/// The two slots for firmware.
pub const SLOTS: [core::ops::Range<u32>; 2] = [0x1_0000..0x15_0000, 0x15_0000..0x29_0000];

#[cfg(test)]
mod tests {
    #[test]
    fn everything_is_where_the_partition_table_says() {
        let table = include_str!("../../partitions.csv");
        let [first, second] = super::SLOTS;
        for (name, range) in [
            ("settings,", super::SETTINGS),
            ("drawings,", super::DRAWINGS),
            ("otadata,", super::BOOT_CHOICE),
            ("ota_0,", first),
            ("ota_1,", second),
        ] {
            let row = table.lines().find(|line| line.starts_with(name)).unwrap();
            let fields: Vec<&str> = row.split(',').map(str::trim).collect();
            let number =
                |text: &str| u32::from_str_radix(text.trim_start_matches("0x"), 16).unwrap();
            let (start, size) = (number(fields[3]), number(fields[4]));
            assert_eq!(range, start..start + size, "{name}");
        }
        // All of it is used.
        let pages = super::DRAWINGS.len() / 4096;
        assert_eq!(pages, crate::services::drawings::MAX_SHEETS);
    }
}
