//! One file for a chip's flash: bootloader, partition table and firmware.

use anyhow::{Context, Result, bail};
use std::fs;
use std::path::PathBuf;
use xtask::board::{Board, own_cargo, root, run, target_dir};
use xtask::slots;

/// Builds the firmware and gives what goes into a slot.
pub fn slot_image(board: Board, setup: bool) -> Result<Vec<u8>> {
    if board == Board::Virt {
        let firmware = board.build(board.binary(), &[], setup)?;
        return slots::flatten(&firmware);
    }
    let mut file = image(board, setup)?.into_os_string();
    file.push(".app");
    let file = PathBuf::from(file);
    fs::read(&file).with_context(|| file.display().to_string())
}

/// Builds the firmware and makes the file.
pub fn image(board: Board, setup: bool) -> Result<PathBuf> {
    if !board.is_chip() {
        bail!("{} has no flash to make an image for", board.name());
    }
    let firmware = board.build(board.binary(), &[], setup)?;
    let version = env!("CARGO_PKG_VERSION");
    let file = target_dir().join(format!("quill-{version}-{}.bin", board.name()));
    // A program of its own, because espflash's library takes longer to build than all other commands.
    let mut tool = own_cargo();
    tool.current_dir(root())
        .args(["run", "--quiet", "--package", "image", "--", board.name()])
        .arg(firmware)
        .arg(root().join("firmware/partitions.csv"))
        .arg(&file);
    run(&mut tool)?;
    Ok(file)
}
