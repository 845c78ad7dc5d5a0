//! What serving and drawing a file have in common: the arm, its memory, its drawings.

use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_time::Duration;
use firmware::board::Vitals;
use firmware::boards::desktop::flash::{self, FileFlash};
use firmware::boards::desktop::recorder::RecordedServos;
use firmware::boards::desktop::{IDENTITY, own_network};
use firmware::services::House;
use firmware::services::arm::TimedFrames;
use firmware::services::drawings::Album;
use firmware::services::storage::Memory;
use protocol_core::machine::ArmData;
use std::io;

/// Settings and drawings are in files, which do not make one wait.
pub type Flash = BlockingAsync<FileFlash>;

/// The drawings in a flash.
pub fn album(flash: FileFlash) -> io::Result<Album<Flash>> {
    let album = Album::new(BlockingAsync::new(flash), 0..flash::DRAWINGS_SIZE);
    let mut album = album.ok_or_else(|| io::Error::other("the flash does not hold whole pages"))?;
    embassy_futures::block_on(album.open());
    Ok(album)
}

/// An arm with what its flash remembers, in the computer's own network where it is `at_home` and remembers none.
pub fn house(
    data: ArmData,
    flash: FileFlash,
    at_home: bool,
    vitals: Vitals,
) -> io::Result<(&'static House, Memory<Flash>)> {
    let memory = Memory::new(BlockingAsync::new(flash), 0..flash::SIZE);
    let mut memory =
        memory.ok_or_else(|| io::Error::other("the flash does not hold whole pages"))?;
    let (mut settings, _) = embassy_futures::block_on(memory.load());
    if at_home && settings.networks.is_empty() {
        let _ = settings.networks.put(own_network());
    }
    let house = House::new(data, settings, IDENTITY, vitals);
    Ok((Box::leak(Box::new(house)), memory))
}

#[embassy_executor::task]
pub async fn arm(house: &'static House, servos: RecordedServos, frame: Duration) {
    house
        .arm
        .tick(servos.of(&house.arm), TimedFrames::every(frame), frame)
        .await;
}

#[embassy_executor::task]
pub async fn storage(house: &'static House, memory: Memory<Flash>) {
    house.store.run(memory).await;
}

#[embassy_executor::task]
pub async fn drawings(house: &'static House, album: Album<Flash>) {
    house.drawings.run(album).await;
}
