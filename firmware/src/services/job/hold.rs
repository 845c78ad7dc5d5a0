//! The G-code that the machine holds: a ring of bytes, written in pieces that are taken whole or not at
//! all, and read while the arm draws.
//!
//! Places are counted from the beginning of the drawing. A place is overwritten when it has been drawn
//! and the room is needed, so a drawing that fits is held from its beginning to its end.

/// The ring.
pub(super) struct Hold {
    room: &'static mut [u8],
    /// What has been drawn: its room may be used again.
    drawn: usize,
    /// What has been taken.
    received: usize,
    /// With the piece that is being taken.
    written: usize,
}

impl Hold {
    pub(super) fn new(room: &'static mut [u8]) -> Self {
        Self {
            room,
            drawn: 0,
            received: 0,
            written: 0,
        }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        (self.drawn, self.received, self.written) = (0, 0, 0);
    }

    /// Bytes that there is room for in all.
    pub(super) fn capacity(&self) -> usize {
        self.room.len()
    }

    /// Bytes that fit now.
    pub(super) fn free(&self) -> usize {
        self.capacity() - (self.written - self.drawn)
    }

    pub(super) fn drawn(&self) -> usize {
        self.drawn
    }

    pub(super) fn received(&self) -> usize {
        self.received
    }

    /// Nothing has been overwritten.
    pub(super) fn has_beginning(&self) -> bool {
        self.written <= self.capacity()
    }

    /// Adds to the piece that is being taken; says whether it fits.
    pub(super) fn write(&mut self, bytes: &[u8]) -> bool {
        if bytes.len() > self.free() {
            return false;
        }
        // At most two stretches: up to the end of the ring, and from its beginning.
        let at = self.written % self.capacity().max(1);
        let first = bytes.len().min(self.capacity() - at);
        let (first, second) = bytes.split_at(first);
        for (at, stretch) in [(at, first), (0, second)] {
            if let Some(room) = self.room.get_mut(at..at + stretch.len()) {
                room.copy_from_slice(stretch);
            }
        }
        self.written += bytes.len();
        true
    }

    /// The piece is whole: it is taken.
    pub(super) fn keep(&mut self) {
        self.received = self.written;
    }

    /// The piece is not taken.
    pub(super) fn drop_piece(&mut self) {
        self.written = self.received;
    }

    /// Copies what was taken, from a place that still is there; gives how many bytes.
    pub(super) fn read(&self, place: usize, into: &mut [u8]) -> usize {
        let at = place % self.capacity().max(1);
        let length = into
            .len()
            .min(self.received.saturating_sub(place))
            .min(self.capacity() - at);
        match (into.get_mut(..length), self.room.get(at..at + length)) {
            (Some(into), Some(from)) => {
                into.copy_from_slice(from);
                length
            }
            _ => 0,
        }
    }

    /// So much more has been drawn.
    pub(super) fn advance(&mut self, bytes: usize) {
        self.drawn = (self.drawn + bytes).min(self.received);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::boxed::Box;
    use std::vec;
    use std::vec::Vec;

    fn hold(capacity: usize) -> Hold {
        Hold::new(Box::leak(vec![0; capacity].into_boxed_slice()))
    }

    fn read(hold: &Hold, place: usize, length: usize) -> Vec<u8> {
        let mut bytes = vec![0; length];
        let mut at = 0;
        while at < length {
            let read = hold.read(place + at, &mut bytes[at..]);
            if read == 0 {
                break;
            }
            at += read;
        }
        bytes.truncate(at);
        bytes
    }

    #[test]
    fn a_piece_that_does_not_fit_or_is_dropped_leaves_nothing() {
        let mut hold = hold(8);
        assert!(hold.write(b"abcde"));
        assert_eq!(read(&hold, 0, 8), b"", "not taken yet");
        hold.keep();
        assert!(!hold.write(b"fghi"));
        assert!(hold.write(b"fg"));
        hold.drop_piece();
        assert_eq!((hold.received(), hold.free()), (5, 3));
        assert_eq!(read(&hold, 0, 8), b"abcde");
    }

    #[test]
    fn room_is_used_again_when_it_is_drawn() {
        let mut hold = hold(8);
        let mut expected = Vec::new();
        for round in 0..20_u8 {
            let piece = [round, round + 100, round + 200];
            assert!(hold.write(&piece));
            hold.keep();
            expected.extend(piece);
            let place = hold.drawn();
            assert_eq!(read(&hold, place, 99), expected[place..]);
            hold.advance(if round % 2 == 0 { 2 } else { 4 });
            assert_eq!(hold.has_beginning(), expected.len() <= 8);
        }
    }

    #[test]
    fn no_room_at_all() {
        let mut hold = hold(0);
        assert!(!hold.write(b"a"));
        assert_eq!((hold.free(), hold.read(0, &mut [0; 4])), (0, 0));
    }
}
