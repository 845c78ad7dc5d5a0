//! From bytes to letters and values: lines out of a byte stream, words out of a line, numbers as
//! exact decimals. Nothing here knows a command.

mod decimal;
mod lines;
mod words;

pub use decimal::{Decimal, OutOfRange};
pub use lines::{LineBuffer, MAX_LINE, TooLong};
pub use words::{MAX_EXCERPT, Text, WordError, Words, excerpt, excerpt_of_bytes};
