//! One file for a chip's flash: bootloader, partition table and firmware.

use anyhow::{Result, bail};
use std::path::PathBuf;
use xtask::board::{Board, own_cargo, root, run, target_dir};

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
