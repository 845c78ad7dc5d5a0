//! From the network into a slot, and read back from it.

use super::body::Body;
use embedded_io_async::Read;
use embedded_storage_async::nor_flash::{NorFlash, ReadNorFlash};
use protocol_core::update::{Manifest, Rejection};
use sha2::{Digest, Sha256};

/// Bytes that are in memory at a time.
const PIECE: usize = 1024;

/// Memory of the words that flashes are made of.
#[repr(align(4))]
struct Piece([u8; PIECE]);

/// Writes an image into a slot, erasing page after page ahead of it.
pub async fn write<S: Read, F: NorFlash>(
    image: &mut Body<'_, S>,
    slot: &mut F,
    manifest: &Manifest<'_>,
    mut show: impl FnMut(u8),
) -> Result<(), Rejection> {
    const {
        assert!(PIECE.is_multiple_of(F::WRITE_SIZE) && F::ERASE_SIZE.is_multiple_of(PIECE));
    }
    let mut hash = Sha256::new();
    let mut piece = Piece([0; PIECE]);
    let mut at = 0;
    while at < manifest.size {
        let filled = fill(image, &mut piece.0).await?;
        let bytes = piece.0.get(..filled).unwrap_or_default();
        hash.update(bytes);
        if at.is_multiple_of(F::ERASE_SIZE as u32) {
            let erased = slot.erase(at, at + F::ERASE_SIZE as u32).await;
            erased.map_err(|_| Rejection::FlashFails)?;
        }
        if let Some(rest) = piece.0.get_mut(filled..) {
            rest.fill(0xff);
        }
        let words = piece.0.get(..filled.next_multiple_of(F::WRITE_SIZE));
        let written = slot.write(at, words.unwrap_or_default()).await;
        written.map_err(|_| Rejection::FlashFails)?;
        at += filled as u32;
        show(image.percent());
    }
    match hash.finalize().as_slice() == manifest.sha256 {
        true => Ok(()),
        false => Err(Rejection::WrongHash),
    }
}

/// Fills the piece, unless the image ends in it.
async fn fill<S: Read>(image: &mut Body<'_, S>, piece: &mut [u8]) -> Result<usize, Rejection> {
    let mut filled = 0;
    while let Some(free @ [_, ..]) = piece.get_mut(filled..) {
        match image.read(free).await? {
            0 => break,
            count => filled += count,
        }
    }
    Ok(filled)
}

/// Whether a slot holds the image.
pub async fn check<F: ReadNorFlash>(
    slot: &mut F,
    manifest: &Manifest<'_>,
) -> Result<(), Rejection> {
    let mut hash = Sha256::new();
    let mut piece = Piece([0; PIECE]);
    let mut at = 0;
    while at < manifest.size {
        let length = PIECE.min((manifest.size - at) as usize);
        // Whole words: the slot is made of them.
        let words = piece.0.get_mut(..length.next_multiple_of(F::READ_SIZE));
        let words = words.unwrap_or_default();
        let read = slot.read(at, words).await;
        read.map_err(|_| Rejection::FlashFails)?;
        hash.update(words.get(..length).unwrap_or_default());
        at += length as u32;
    }
    match hash.finalize().as_slice() == manifest.sha256 {
        true => Ok(()),
        false => Err(Rejection::FlashDiffers),
    }
}
