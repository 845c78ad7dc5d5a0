//! Line-us G-code: typed commands, replies, one session for each connection
//! (specification 1.0.4a with `reference/line-us.md`).

mod command;
mod recording;
mod refusal;
mod reply;
mod request;
mod session;

pub use command::{Command, parse};
pub use refusal::Refusal;
pub use reply::{Diagnostics, Identity, InWords, MAX_REPLY, Reply, STOPPED, TERMINATOR, VERSION};
pub use request::Request;
pub use session::Session;
