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

#[cfg(test)]
mod tests {
    #[test]
    fn the_settings_are_where_the_partition_table_says() {
        let table = include_str!("../../partitions.csv");
        let row = table
            .lines()
            .find(|line| line.starts_with("settings,"))
            .unwrap();
        let fields: Vec<&str> = row.split(',').map(str::trim).collect();
        let number = |text: &str| u32::from_str_radix(text.trim_start_matches("0x"), 16).unwrap();
        let (start, size) = (number(fields[3]), number(fields[4]));
        assert_eq!(super::SETTINGS, start..start + size);
    }
}
