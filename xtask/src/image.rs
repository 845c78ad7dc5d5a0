//! One file for a chip's flash: bootloader, partition table and firmware, and settings if they are given.

use anyhow::{Context, Result, bail, ensure};
use firmware::boards::desktop::slots::SLOT_SIZE;
use std::fs;
use std::path::{Path, PathBuf};
use xtask::board::{Board, own_cargo, root, run, target_dir};
use xtask::emulator::FLASH_SIZE;
use xtask::ready::{self, Owner};
use xtask::slots;

/// Builds the firmware and gives what goes into a slot.
pub fn slot_image(board: Board, setup: bool) -> Result<Vec<u8>> {
    if board == Board::Virt {
        let firmware = board.build(board.binary(), &[], setup)?;
        return slots::flatten(&firmware);
    }
    if board == Board::Desktop {
        let program = board.build(board.binary(), &[], setup)?;
        let image = fs::read(&program).with_context(|| program.display().to_string())?;
        ensure!(
            image.len() <= SLOT_SIZE as usize,
            "the program does not fit a slot"
        );
        return Ok(image);
    }
    let mut file = image(board, &Owner::default(), setup)?.into_os_string();
    file.push(".app");
    let file = PathBuf::from(file);
    fs::read(&file).with_context(|| file.display().to_string())
}

/// Builds the firmware and makes the file.
pub fn image(board: Board, owner: &Owner, setup: bool) -> Result<PathBuf> {
    // What is wrong with them is known before anything takes minutes.
    let settings = owner.settings()?;
    let stem = format!("quill-{}-{}", env!("CARGO_PKG_VERSION"), board.name());
    let table = root().join("firmware/partitions.csv");
    let (file, mut bytes) = match (board, &settings) {
        (Board::Desktop, _) => bail!("desktop has no flash to make an image for"),
        (Board::Virt, None) => {
            bail!("the flash of virt has settings alone in it: which? (--network, --name)")
        }
        (Board::Virt, Some(_)) => {
            let file = target_dir().join(format!("{stem}.flash"));
            (file, vec![0xff; usize::try_from(FLASH_SIZE)?])
        }
        (chip, None) => {
            let file = target_dir().join(format!("{stem}.bin"));
            make(chip, &table, &file, setup)?;
            return Ok(file);
        }
        (chip, Some(_)) => {
            let plain = target_dir().join(format!("{stem}.bin"));
            make(chip, &table, &plain, setup)?;
            let bytes = fs::read(&plain).with_context(|| plain.display().to_string())?;
            (target_dir().join(format!("{stem}-ready.bin")), bytes)
        }
    };
    if let Some(settings) = &settings {
        let table = fs::read_to_string(&table).with_context(|| table.display().to_string())?;
        ready::put_into(&mut bytes, settings, &table)?;
    }
    fs::write(&file, bytes).with_context(|| file.display().to_string())?;
    Ok(file)
}

fn make(board: Board, table: &Path, file: &Path, setup: bool) -> Result<()> {
    let firmware = board.build(board.binary(), &[], setup)?;
    // A program of its own, because espflash's library takes longer to build than all other commands.
    let mut tool = own_cargo();
    tool.current_dir(root())
        .args(["run", "--quiet", "--package", "image", "--", board.name()])
        .arg(firmware)
        .arg(table)
        .arg(file);
    run(&mut tool)
}
