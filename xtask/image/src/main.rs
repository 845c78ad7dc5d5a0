//! `image CHIP ELF PARTITIONS.CSV OUT` makes two files out of a program for an ESP32: `OUT`, everything
//! from the bootloader on, to be written to flash at 0, and `OUT.app`, the program alone, as it goes into
//! a firmware slot.

use anyhow::{Context, Result, ensure};
use espflash::flasher::{FlashData, FlashSettings, FlashSize};
use espflash::image_format::idf::IdfBootloaderFormat;
use espflash::target::Chip;
use std::path::Path;
use std::{env, fs};

/// The partition that the bootloader starts as long as no update has chosen another.
const FIRST_SLOT: &str = "ota_0";

fn main() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [chip, elf, partitions, out] = arguments.as_slice() else {
        anyhow::bail!("usage: image CHIP ELF PARTITIONS.CSV OUT");
    };
    let chip: Chip = chip
        .parse()
        .ok()
        .with_context(|| format!("{chip} is not a chip that espflash knows"))?;
    let program = fs::read(elf).with_context(|| elf.clone())?;

    let settings = FlashSettings::new(None, Some(FlashSize::_4Mb), None);
    let data = FlashData::new(settings, 0, None, chip, chip.default_xtal_frequency());
    let table = Some(Path::new(partitions));
    let image = IdfBootloaderFormat::new(&program, &data, table, None, None, Some(FIRST_SLOT))?;

    for segment in image.clone().ota_segments() {
        write(&format!("{out}.app"), segment.data())?;
    }
    let mut merged = Vec::new();
    for segment in image.flash_segments() {
        let address = usize::try_from(segment.addr)?;
        ensure!(address >= merged.len(), "parts of the image overlap");
        merged.resize(address, 0xff);
        merged.extend_from_slice(segment.data());
    }
    write(out, &merged)
}

fn write(file: &str, bytes: &[u8]) -> Result<()> {
    fs::write(file, bytes).with_context(|| file.to_owned())?;
    println!("{file}: {} bytes", bytes.len());
    Ok(())
}
