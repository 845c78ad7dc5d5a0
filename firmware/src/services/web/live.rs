//! The state, pushed over a WebSocket as it changes.

use super::exchange::Room;
use super::frames::{Frames, MAX_HEAD, put};
use super::state::{MAX_STATE, Snapshot, write_state};
use crate::services::House;
use crate::services::line_us::Answers;
use crate::services::web::frames::Event;
use edge_ws::FrameType;
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Instant, Timer};
use embedded_io_async::{Read, Write};
use heapless::Vec;
use protocol_core::motion::Position;
use serde::Serialize;

/// How often the pen is looked at while it moves.
const LOOK: Duration = Duration::from_millis(40);
/// Places of the pen in one message.
const MAX_TRAIL: usize = 8;
/// Looks between two messages of the pen.
const LOOKS: usize = 5;
/// How often the arm at rest is looked at.
const LOOK_AT_REST: Duration = Duration::from_millis(100);
/// Shortest time between two messages of the state.
const STATE: Duration = Duration::from_millis(250);
/// Longest time between two messages of the state.
const STATE_AT_LEAST: Duration = Duration::from_secs(10);
/// Bytes taken from a client at a time: it has nothing to say.
const CHUNK: usize = 64;

const MAX_MESSAGE: usize = MAX_STATE + MAX_HEAD;

/// Serves one client until it has closed. `here` bytes from it are in the room.
pub async fn serve<S: Read + Write>(socket: S, room: &mut Room, here: usize, house: &House) {
    let mut live = Live {
        answers: Answers::new(socket),
        message: Vec::new(),
        frames: Frames::new(),
        trail: Vec::new(),
        told: None,
        hash: 0,
        state_at: None,
    };
    let mut input = room.get_mut(..here).unwrap_or_default();
    if live.take(&mut input).await.is_err() {
        return;
    }
    let mut chunk = [0; CHUNK];
    loop {
        let moving = live.look(house, room).await;
        let pause = Timer::after(if moving { LOOK } else { LOOK_AT_REST });
        match select(live.answers.read(&mut chunk), pause).await {
            Either::First(Ok(read @ 1..)) => {
                let mut input = chunk.get_mut(..read).unwrap_or_default();
                if live.take(&mut input).await.is_err() {
                    return;
                }
            }
            Either::First(_) => return,
            Either::Second(()) => {}
        }
    }
}

/// The connection has ended.
struct Closed;

struct Live<S> {
    answers: Answers<S, MAX_MESSAGE>,
    message: Vec<u8, MAX_MESSAGE>,
    frames: Frames,
    /// Where the pen was since the last message.
    trail: Vec<[i32; 3], MAX_TRAIL>,
    /// The last place that was told or is in the trail, and whether the arm moved.
    told: Option<(Position, bool)>,
    /// Of the last state.
    hash: u32,
    state_at: Option<Instant>,
}

#[derive(Serialize)]
struct PenMessage<'a> {
    pen: Pen<'a>,
}

#[derive(Serialize)]
struct Pen<'a> {
    trail: &'a [[i32; 3]],
    moving: bool,
}

impl<S: Read + Write> Live<S> {
    /// Takes what the client sends: pings and the end mean something.
    async fn take(&mut self, input: &mut &mut [u8]) -> Result<(), Closed> {
        loop {
            match self.frames.next(input) {
                Ok(None) => return Ok(()),
                Ok(Some(Event::Ping(content))) => {
                    put(&mut self.message, FrameType::Pong, &content);
                    self.answers.send_message(&self.message).await;
                }
                Ok(Some(_)) => {}
                Err(code) => {
                    put(&mut self.message, FrameType::Close, &code.0.to_be_bytes());
                    self.answers.send_message(&self.message).await;
                    return Err(Closed);
                }
            }
        }
    }

    /// Looks at the arm and tells what is new; says whether it moves.
    async fn look(&mut self, house: &House, room: &mut Room) -> bool {
        let (position, moving) = house
            .arm
            .with(|machine| (machine.position(), machine.is_busy()));
        let before = self.told.replace((position, moving));
        let moved = before.is_some_and(|(before, _)| before != position);
        let came_to_rest = !moving && before.is_some_and(|(_, moving)| moving);
        if moved && !self.trail.is_full() {
            let Position { x, y, z } = position;
            let _ = self.trail.push([x.rounded(), y.rounded(), z.rounded()]);
        }
        let enough = self.trail.len() >= LOOKS || (!moving && !self.trail.is_empty());
        if enough || came_to_rest {
            let pen = Pen {
                trail: &self.trail,
                moving,
            };
            let length = serde_json_core::to_slice(&PenMessage { pen }, room).unwrap_or(0);
            self.send(room, length).await;
            self.trail.clear();
        }
        self.tell_state(house, room).await;
        moving
    }

    async fn tell_state(&mut self, house: &House, room: &mut Room) {
        let age = self.state_at.map(|at| at.elapsed());
        if age.is_some_and(|age| age < STATE) {
            return;
        }
        let mut snapshot = Snapshot::of(house);
        let passing = snapshot.at_rest();
        let length = write_state(&snapshot, room);
        let hash = hash(room.get(..length).unwrap_or_default());
        if hash == self.hash && age.is_some_and(|age| age < STATE_AT_LEAST) {
            return;
        }
        (self.hash, self.state_at) = (hash, Some(Instant::now()));
        snapshot.restore(passing);
        let length = write_state(&snapshot, room);
        drop(snapshot);
        self.send(room, length).await;
    }

    async fn send(&mut self, room: &Room, length: usize) {
        let text = room.get(..length).unwrap_or_default();
        put(&mut self.message, FrameType::Text(false), text);
        self.answers.send_message(&self.message).await;
    }
}

/// FNV-1a: whether two states differ, nothing more.
fn hash(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0x811c_9dc5, |hash: u32, byte| {
        (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193)
    })
}
