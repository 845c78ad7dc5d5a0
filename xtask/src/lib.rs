//! What the developer's commands are made of; the emulator is also what its tests drive.

pub mod bench;
pub mod board;
pub mod emulator;
pub mod ready;
pub mod records;
pub mod release;
pub mod size;
pub mod slots;
pub mod toolchain;
