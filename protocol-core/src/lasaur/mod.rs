//! LasaurGrbl's serial protocol: bytes in, typed steps and replies out, one session for each connection
//! (the wiki page *LasaurGrbl G-code Protocol* with `reference/lasaurgrbl.md`).
//!
//! ```text
//! byte -> receive buffer -> line -> checksum, redundancy -> words -> Command -> modal state -> steps
//!     \-> `!` `~` 0x14: at once                                                    reply <- facts
//! ```
//!
//! A session touches nothing. Whoever runs one does this, and nothing of it waits but the steps:
//!
//! 1. [`Session::next_event`] with what was received. An [`Effect`] is done at once. A line is begun
//!    with [`Session::begin_line`], told the machine's [`Facts`].
//! 2. The line's steps go into the plan, in order. While it is full, bytes go on to be received with
//!    [`Session::next_event`], which then gives no line; when [`Session::is_void`] says so, or the machine
//!    does not take a step because it is stopped ([`Session::discard`]), the rest of them are dropped.
//! 3. [`Session::reply`] writes the answer, with the facts of that moment.
//!
//! So a line takes effect before the byte after it is looked at, and how the bytes were cut into packets
//! does not show. Where the table ends, and what comes of leaving it, is the machine's affair.

mod checksum;
mod command;
mod modal;
mod receive;
mod redundancy;
mod reply;
mod session;
mod stop;
mod units;
mod words;

pub use checksum::{checksum, is_right};
pub use command::Fault;
pub use modal::{DEFAULT_OFFSET, MAX_STEPS, Step, Steps};
pub use receive::{CHUNK, Effect, MAX_LINE, READY, RECEIVE_BUFFER};
pub use reply::{BANNER, MAX_REPLY, Reply, Sensors, VERSION};
pub use session::{Event, Facts, Line, Session};
pub use units::MAX_COORDINATE;
