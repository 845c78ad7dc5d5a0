//! WebSocket frames (RFC 6455): bytes of a client become messages, whatever the packets they came in.
//!
//! Nothing is collected but the head of a frame and the payload of a ping, so no frame is too large for
//! memory. Whoever breaks the rules is told the code with which the connection ends.

use edge_ws::{Error, FrameHeader, FrameType};
use heapless::Vec;

/// Longest frame that is taken, in bytes of its payload.
pub const MAX_FRAME: u64 = 4096;
/// Longest payload of a control frame (RFC 6455, section 5.5).
pub const MAX_CONTROL: usize = 125;
/// Longest head of a frame that the machine sends: it does not mask.
pub const MAX_HEAD: usize = 4;

/// Why a connection ends (RFC 6455, section 7.4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code(pub u16);

impl Code {
    /// All is done.
    pub const NORMAL: Self = Self(1000);
    /// The client breaks the rules.
    pub const PROTOCOL: Self = Self(1002);
    /// The client sends what is not text.
    pub const NOT_TEXT: Self = Self(1003);
    /// The client sends a frame that is too large.
    pub const TOO_LARGE: Self = Self(1009);
}

/// What has been received.
#[derive(Debug, PartialEq, Eq)]
pub enum Event<'a> {
    /// A part of a text message.
    Text(&'a [u8]),
    /// The text message is complete.
    End,
    /// The client wants to have this back.
    Ping(Vec<u8, MAX_CONTROL>),
}

/// What is received of a frame now.
#[derive(Debug)]
struct Current {
    head: FrameHeader,
    received: usize,
}

/// The receiving half of a WebSocket.
#[derive(Debug, Default)]
pub struct Frames {
    /// The head of the next frame, as far as it is here.
    head: Vec<u8, { FrameHeader::MAX_LEN }>,
    current: Option<Current>,
    /// A message has begun and is not complete.
    in_message: bool,
    control: Vec<u8, MAX_CONTROL>,
}

impl Frames {
    /// At the beginning of a connection.
    pub const fn new() -> Self {
        Self {
            head: Vec::new(),
            current: None,
            in_message: false,
            control: Vec::new(),
        }
    }

    /// Takes bytes off the front of `input`, which are changed, up to the next event; `None` when they are
    /// used up first.
    ///
    /// # Errors
    /// The code with which the connection ends, also where the client wants it to end.
    pub fn next<'a>(&mut self, input: &mut &'a mut [u8]) -> Result<Option<Event<'a>>, Code> {
        loop {
            let Some(current) = &mut self.current else {
                let Some(head) = self.next_head(input)? else {
                    return Ok(None);
                };
                self.current = Some(Current { head, received: 0 });
                continue;
            };
            let left = current.head.payload_len as usize - current.received;
            if left > 0 && input.is_empty() {
                return Ok(None);
            }
            let here = left.min(input.len());
            let (payload, rest) = core::mem::take(input).split_at_mut(here);
            *input = rest;
            current.head.mask(payload, current.received);
            current.received += here;
            let kind = current.head.frame_type;
            let complete = here == left;
            match kind {
                FrameType::Text(_) | FrameType::Continue(_) => {
                    // The end comes by itself, after the last piece.
                    if !payload.is_empty() {
                        return Ok(Some(Event::Text(payload)));
                    }
                    self.current = None;
                    if kind.is_final() {
                        self.in_message = false;
                        return Ok(Some(Event::End));
                    }
                }
                FrameType::Ping | FrameType::Pong | FrameType::Close => {
                    // No control frame is longer.
                    let _ = self.control.extend_from_slice(payload);
                    if complete {
                        self.current = None;
                        let content = core::mem::take(&mut self.control);
                        match kind {
                            FrameType::Ping => return Ok(Some(Event::Ping(content))),
                            FrameType::Close => return Err(Code::NORMAL),
                            _ => {}
                        }
                    }
                }
                FrameType::Binary(_) => return Err(Code::NOT_TEXT),
            }
        }
    }

    /// The head of the next frame, if all of it is here and it keeps the rules.
    fn next_head(&mut self, input: &mut &mut [u8]) -> Result<Option<FrameHeader>, Code> {
        loop {
            match FrameHeader::deserialize(&self.head) {
                Ok((head, _)) => {
                    self.head.clear();
                    return self.admit(head).map(Some);
                }
                Err(Error::Incomplete(_)) => {}
                Err(_) => return Err(Code::PROTOCOL),
            }
            let Some((byte, rest)) = core::mem::take(input).split_first_mut() else {
                return Ok(None);
            };
            *input = rest;
            // A head is never longer than this.
            let _ = self.head.push(*byte);
        }
    }

    fn admit(&mut self, head: FrameHeader) -> Result<FrameHeader, Code> {
        if head.mask_key.is_none() {
            return Err(Code::PROTOCOL);
        }
        match head.frame_type {
            FrameType::Binary(_) => return Err(Code::NOT_TEXT),
            FrameType::Text(_) if self.in_message => return Err(Code::PROTOCOL),
            FrameType::Continue(_) if !self.in_message => return Err(Code::PROTOCOL),
            FrameType::Text(_) | FrameType::Continue(_) => self.in_message = true,
            FrameType::Ping | FrameType::Pong | FrameType::Close => {
                if head.payload_len > MAX_CONTROL as u64 {
                    return Err(Code::PROTOCOL);
                }
            }
        }
        if head.payload_len > MAX_FRAME {
            return Err(Code::TOO_LARGE);
        }
        Ok(head)
    }
}

/// Puts a frame into `out`, which has room for it: `payload` and [`MAX_HEAD`] bytes.
pub fn put<const N: usize>(out: &mut Vec<u8, N>, kind: FrameType, payload: &[u8]) {
    let head = FrameHeader {
        frame_type: kind,
        payload_len: payload.len() as u64,
        mask_key: None,
    };
    let mut bytes = [0; FrameHeader::MAX_LEN];
    let length = head.serialize(&mut bytes).unwrap_or_default();
    out.clear();
    let _ = out.extend_from_slice(bytes.get(..length).unwrap_or_default());
    let _ = out.extend_from_slice(payload);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec;
    use std::vec::Vec as StdVec;

    /// A frame of a client, by the book (RFC 6455, section 5.2).
    fn frame(first: u8, payload: &[u8]) -> StdVec<u8> {
        let mut bytes = vec![first];
        match payload.len() {
            length @ 0..=125 => bytes.push(0x80 | length as u8),
            length => {
                bytes.push(0x80 | 126);
                bytes.extend((length as u16).to_be_bytes());
            }
        }
        let key = [0x37, 0xfa, 0x21, 0x3d];
        bytes.extend(key);
        bytes.extend(payload.iter().zip(key.iter().cycle()).map(|(a, b)| a ^ b));
        bytes
    }

    /// Messages and pings of a stream that comes in pieces of that size, and the code at its end.
    fn received(stream: &[u8], piece: usize) -> (StdVec<StdVec<u8>>, Option<Code>) {
        let mut frames = Frames::new();
        let (mut found, mut message) = (StdVec::new(), StdVec::new());
        for piece in stream.chunks(piece) {
            let mut piece = piece.to_vec();
            let mut input = &mut piece[..];
            loop {
                match frames.next(&mut input) {
                    Ok(None) => break,
                    Ok(Some(Event::Text(text))) => message.extend_from_slice(text),
                    Ok(Some(Event::End)) => found.push(core::mem::take(&mut message)),
                    Ok(Some(Event::Ping(content))) => found.push(content.to_vec()),
                    Err(code) => return (found, Some(code)),
                }
            }
        }
        (found, None)
    }

    #[test]
    fn the_example_of_the_rfc() {
        let hello = [
            0x81, 0x85, 0x37, 0xfa, 0x21, 0x3d, 0x7f, 0x9f, 0x4d, 0x51, 0x58,
        ];
        assert_eq!(received(&hello, 99), (vec![b"Hello".to_vec()], None));
        assert_eq!(frame(0x81, b"Hello"), hello);
    }

    #[test]
    fn fragments_with_a_ping_between_them() {
        let stream = [
            frame(0x01, b"G01 "),
            frame(0x89, b"there?"),
            frame(0x00, b"X5"),
            frame(0x80, b""),
            frame(0x81, b""),
            frame(0x8a, b"pong"),
            frame(0x81, &[b'x'; 300]),
            frame(0x88, &[3, 232]),
        ]
        .concat();
        let expected = vec![
            b"there?".to_vec(),
            b"G01 X5".to_vec(),
            vec![],
            vec![b'x'; 300],
        ];
        for piece in [1, 2, 7, 1000] {
            let found = received(&stream, piece);
            assert_eq!(found, (expected.clone(), Some(Code::NORMAL)), "{piece}");
        }
    }

    #[test]
    fn who_breaks_the_rules_is_told_so() {
        let huge = [&[0x81, 0xff][..], &[0xff; 8], &[0; 4]].concat();
        for (stream, code) in [
            (frame(0x82, b"binary"), Code::NOT_TEXT),
            (vec![0x81, 0x05, b'H'], Code::PROTOCOL),
            (frame(0x80, b"nothing begun"), Code::PROTOCOL),
            (
                [frame(0x01, b"a"), frame(0x81, b"b")].concat(),
                Code::PROTOCOL,
            ),
            (frame(0x83, b"reserved"), Code::PROTOCOL),
            (frame(0xc1, b"compressed"), Code::PROTOCOL),
            (frame(0x89, &[0; 126]), Code::PROTOCOL),
            (frame(0x81, &[0; 4097]), Code::TOO_LARGE),
            (huge, Code::TOO_LARGE),
        ] {
            assert_eq!(received(&stream, 3), (vec![], Some(code)), "{stream:?}");
        }
    }

    #[test]
    fn frames_of_the_machine() {
        let mut out = Vec::<u8, 400>::new();
        put(&mut out, FrameType::Text(false), b"Hello");
        assert_eq!(out, b"\x81\x05Hello");
        put(&mut out, FrameType::Text(false), &[b'x'; 300]);
        assert_eq!(&out[..6], b"\x81\x7e\x01\x2cxx");
        assert_eq!(out.len(), 304);
    }

    proptest! {
        #[test]
        fn any_bytes_in_any_pieces_mean_the_same(stream: StdVec<u8>, piece in 1..20_usize) {
            prop_assert_eq!(received(&stream, piece), received(&stream, stream.len().max(1)));
        }
    }
}
