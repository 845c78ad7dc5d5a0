//! The emulated machine's firmware slots, and the bootloader that it does not have.

use anyhow::{Context, Result, ensure};
use firmware::boards::{BOOT_CHOICE, SLOTS};
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{Endianness, elf};
use protocol_core::update::{BootChoice, ENTRY, PAGE, Slot};
use std::fs::{self, File};
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

/// Where the machine's memory begins, and with it every image.
const START: u32 = 0x8000_0000;

/// The image that starts: of the chosen slot, as a bootloader does it. `None` while that is the first one
/// and nothing has been written there: then what was built starts, as if it had been flashed.
pub fn image(flash: &Path) -> Result<Option<Vec<u8>>> {
    let named = || flash.display().to_string();
    let mut file = File::open(flash).with_context(named)?;
    let mut read = |at: u32, length: usize| -> Result<Vec<u8>> {
        let mut bytes = vec![0; length];
        file.seek(SeekFrom::Start(at.into()))?;
        file.read_exact(&mut bytes).with_context(named)?;
        Ok(bytes)
    };
    let mut entry = |at: u32| -> Result<[u8; ENTRY]> {
        Ok(read(BOOT_CHOICE.start + at, ENTRY)?
            .try_into()
            .unwrap_or([0xff; ENTRY]))
    };
    let choice = BootChoice::read(&entry(0)?, &entry(PAGE)?);
    let [first, second] = SLOTS;
    let Range { start, end } = match choice.slot() {
        Slot::First => first,
        Slot::Second => second,
    };
    let mut image = read(start, (end - start) as usize)?;
    let length = image.iter().rposition(|byte| *byte != 0xff);
    image.truncate(length.map_or(0, |last| last + 1));
    Ok((!image.is_empty()).then_some(image))
}

/// What a program for the emulated machine is in memory, from the first byte on.
pub fn flatten(program: &Path) -> Result<Vec<u8>> {
    let data = fs::read(program).with_context(|| program.display().to_string())?;
    let file = ElfFile32::<Endianness>::parse(&*data)?;
    let header: &FileHeader32<Endianness> = file.elf_header();
    let endian = header.endian()?;
    ensure!(
        header.e_machine(endian) == elf::EM_RISCV,
        "not for this machine"
    );
    let mut image = Vec::new();
    for segment in header.program_headers(endian, &*data)? {
        let content = segment.data(endian, &*data).unwrap_or_default();
        if segment.p_type(endian) != PT_LOAD || content.is_empty() {
            continue;
        }
        let place = segment.p_paddr(endian).checked_sub(START);
        let place = place.context("a segment lies outside the memory")? as usize;
        let end = place + content.len();
        image.resize(end.max(image.len()), 0);
        image
            .get_mut(place..end)
            .context("a segment lies outside the image")?
            .copy_from_slice(content);
    }
    let [slot, _] = SLOTS;
    ensure!(image.len() <= slot.len(), "the image does not fit a slot");
    Ok(image)
}
