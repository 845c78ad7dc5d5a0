//! What happened to the arm, as bytes for the host.
//!
//! A record is a letter and fields of fixed size, little endian, nothing between records:
//!
//! | letter | fields | bytes |
//! |---|---|---|
//! | `S` servo frame | `u64` time in us; `i32` x, y, z in 1/65536 unit; `u32` shoulder, elbow, pen pulse in 0.1 ns; `u32` us late; `u8` flags | 38 |
//! | `L` light | `u64` time in us; `u8` red, green, blue | 12 |
//! | `X` lost | `u32` records lost since power-up, at this place in the stream | 5 |
//!
//! The stream is reliable, so there is neither checksum nor resynchronisation. Nobody ever waits to record: when the host does
//! not read for so long that [`CAPACITY`] records pile up, further ones are counted and the count is recorded.

use core::cell::Cell;

use critical_section::Mutex;
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, channel::Channel};

/// Records that wait for the host: 40 s of servo frames.
pub const CAPACITY: usize = 4096;

/// Longest record in bytes.
pub const LONGEST: usize = 38;

static WAITING: Channel<CriticalSectionRawMutex, Record, CAPACITY> = Channel::new();
/// Records lost since power-up, and how many of them the host has been told of.
static LOST: Mutex<Cell<(u32, u32)>> = Mutex::new(Cell::new((0, 0)));

/// One servo frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Its time on the servo clock, in us.
    pub time_us: u64,
    /// x, y, z in 1/65536 unit.
    pub position: [i32; 3],
    /// Shoulder, elbow, pen in 0.1 ns.
    pub pulses: [u32; 3],
    /// How long after its time it came, in us.
    pub late_us: u32,
    /// Bit 0: held at the edge of the drawing area; bit 1: moving; bit 2: the tick found the processor
    /// asleep, so that it was late by the emulator's fault; bits 3 to 5: air, aux1, aux2 are on.
    pub flags: u8,
}

/// Something the host is told.
#[derive(Clone, Copy, Debug)]
pub enum Record {
    /// A servo frame.
    Servo(Frame),
    /// The light changed.
    Light {
        /// When, in us since power-up.
        time_us: u64,
        /// Red, green, blue.
        rgb: [u8; 3],
    },
    /// Records were lost here; how many since power-up.
    Lost(u32),
}

/// Records; from any context, and never waits.
pub fn record(what: Record) {
    critical_section::with(|cs| {
        let (lost, mut told) = LOST.borrow(cs).get();
        // The gap is announced before anything that follows it.
        if told < lost && WAITING.try_send(Record::Lost(lost)).is_ok() {
            told = lost;
        }
        let kept = told == lost && WAITING.try_send(what).is_ok();
        LOST.borrow(cs).set((lost + u32::from(!kept), told));
    });
}

/// Records lost since power-up.
pub fn lost() -> u32 {
    critical_section::with(|cs| LOST.borrow(cs).get().0)
}

/// Waits for records and encodes as many as there are and fit; returns the length.
pub(super) async fn next_batch(buffer: &mut [u8]) -> usize {
    let mut length = encode(&WAITING.receive().await, buffer);
    while buffer.len() - length >= LONGEST
        && let Ok(record) = WAITING.try_receive()
    {
        length += encode(&record, &mut buffer[length..]);
    }
    length
}

/// Writes one record at the start of `buffer`; returns its length.
fn encode(record: &Record, buffer: &mut [u8]) -> usize {
    let mut length = 0;
    let mut put = |bytes: &[u8]| {
        buffer[length..length + bytes.len()].copy_from_slice(bytes);
        length += bytes.len();
    };
    match record {
        Record::Servo(frame) => {
            put(b"S");
            put(&frame.time_us.to_le_bytes());
            frame
                .position
                .iter()
                .for_each(|axis| put(&axis.to_le_bytes()));
            frame
                .pulses
                .iter()
                .for_each(|pulse| put(&pulse.to_le_bytes()));
            put(&frame.late_us.to_le_bytes());
            put(&[frame.flags]);
        }
        Record::Light { time_us, rgb } => {
            put(b"L");
            put(&time_us.to_le_bytes());
            put(rgb);
        }
        Record::Lost(count) => {
            put(b"X");
            put(&count.to_le_bytes());
        }
    }
    length
}
