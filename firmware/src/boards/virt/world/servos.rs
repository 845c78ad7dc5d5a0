//! The "PWM" of this board: each frame is recorded, to the last bit.

use super::record::{Frame, Record, record};
use crate::board;
use crate::boards::virt::executor;
use embassy_time::Instant;
use protocol_core::machine::SetPoint;
use protocol_core::motion::Micros;

/// The three servos; they give no pulse until the first frame.
#[derive(Default)]
pub struct Servos {
    /// The last frame: when it was due by the clock, and its time.
    last: Option<(Instant, Micros)>,
}

impl board::Servos for Servos {
    fn write(&mut self, time: Micros, set_point: &SetPoint) {
        let now = Instant::now();
        // Frames follow one another at the same distance in both times, or one of them is late.
        let due = self.last.map_or(now, |(due, last)| {
            due + embassy_time::Duration::from_micros((time - last).get())
        });
        let late = now.saturating_duration_since(due).as_micros();
        self.last = Some((due, time));
        let position = [
            set_point.position.x,
            set_point.position.y,
            set_point.position.z,
        ];
        let [air, aux1, aux2] = set_point.outputs;
        let flags = [
            set_point.held,
            set_point.moving,
            executor::woken_from_sleep(),
            air,
            aux1,
            aux2,
        ];
        record(Record::Servo(Frame {
            time_us: time.get(),
            position: position.map(|coordinate| coordinate.bits()),
            pulses: set_point.pulses.map(|pulse| pulse.get()),
            late_us: u32::try_from(late).unwrap_or(u32::MAX),
            flags: flags
                .iter()
                .rev()
                .fold(0, |flags, flag| flags << 1 | u8::from(*flag)),
        }));
    }
}
