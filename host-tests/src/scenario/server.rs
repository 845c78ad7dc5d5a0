//! What the server of updates has, and how it answers.

use super::words::Words;
use crate::scripted::Board;
use crate::scripted::release::{IMAGE, MANIFEST, Release, SigningKey, sign};
use crate::scripted::server::{Answer, End};
use embassy_time::Duration;
use protocol_core::update::Version;

/// Bytes of an image of which nothing is said: more than a page, and not whole pieces of what is read at once.
const SIZE: usize = 5000;

/// What becomes of it.
#[derive(Clone, Debug, PartialEq)]
pub enum ServerAction {
    Offers {
        release: Release,
        /// With the key that the firmware believes.
        believed: bool,
    },
    /// To whatever it is asked.
    Says(Vec<u8>),
    Manifest(Vec<u8>),
    Image(Vec<u8>),
    /// As long as the signed one.
    OtherImage,
    /// After so many bytes of the image.
    Ends(usize, End),
    Paced(usize, Duration),
    Vanishes,
    ComesBack,
}

/// Reads what follows `the server`.
pub fn parse(words: &mut Words<'_>) -> Result<ServerAction, String> {
    Ok(if words.eat("offers") {
        offer(words)?
    } else if words.eat("says") {
        ServerAction::Says(words.text()?)
    } else if words.eat("is silent after") {
        ServerAction::Ends(bytes(words)?, End::Silence)
    } else if words.eat("closes after") {
        ServerAction::Ends(bytes(words)?, End::Close)
    } else if words.eat("sends") {
        let piece = bytes(words)?;
        if piece == 0 || !words.eat("every") {
            return Err("the server sends a number of bytes every so often".into());
        }
        ServerAction::Paced(piece, words.time()?)
    } else if words.eat("vanishes") {
        ServerAction::Vanishes
    } else if words.eat("is back") {
        ServerAction::ComesBack
    } else {
        return Err("the server does no such thing".into());
    })
}

/// Reads what follows `the server's`.
pub fn parse_file(words: &mut Words<'_>) -> Result<ServerAction, String> {
    if words.eat("manifest is") {
        Ok(ServerAction::Manifest(words.text()?))
    } else if words.eat("manifest has") {
        Ok(ServerAction::Manifest(vec![b'x'; bytes(words)?]))
    } else if words.eat("image has") {
        Ok(ServerAction::Image(vec![b'x'; bytes(words)?]))
    } else if words.eat("image is another") {
        Ok(ServerAction::OtherImage)
    } else {
        Err("the server has a manifest and an image".into())
    }
}

fn offer(words: &mut Words<'_>) -> Result<ServerAction, String> {
    let version = words.next_word().unwrap_or_default();
    if Version::parse(version).is_none() {
        return Err("a version is three numbers".into());
    }
    let (mut size, mut board, mut believed) = (SIZE, None, true);
    while words.end().is_err() {
        if words.eat("of") {
            size = bytes(words)?;
        } else if words.eat("for") {
            board = words.next_word();
        } else if words.eat("signed by somebody else") {
            believed = false;
        } else {
            words.end()?;
        }
    }
    let mut release = Release::new(version, size);
    release.board = board.map_or(release.board, str::to_owned);
    Ok(ServerAction::Offers { release, believed })
}

fn bytes(words: &mut Words<'_>) -> Result<usize, String> {
    let count = words.number()?;
    match words.eat("bytes") {
        true => Ok(count),
        false => Err("a number of bytes is missing".into()),
    }
}

/// Does it.
pub fn act(board: &mut Board, action: &ServerAction) {
    let server = board.server.clone();
    match action {
        ServerAction::Offers { release, believed } => {
            board.offer(release);
            if !believed {
                let other = SigningKey::from_bytes(&[7; 32]);
                let text = sign(&release.signed_part(), &other);
                server.put(MANIFEST, Answer::file(text.as_bytes()));
            }
        }
        ServerAction::Says(bytes) => {
            server.put(MANIFEST, Answer::raw(bytes));
            server.put(IMAGE, Answer::raw(bytes));
        }
        ServerAction::Manifest(text) => server.put(MANIFEST, Answer::file(text)),
        ServerAction::Image(image) => server.put(IMAGE, Answer::file(image)),
        ServerAction::OtherImage => server.change(IMAGE, |mut answer| {
            if let Some(last) = answer.bytes.last_mut() {
                *last ^= 1;
            }
            answer
        }),
        ServerAction::Ends(bytes, end) => server.change(IMAGE, |answer| {
            let body = answer.bytes.windows(4).position(|four| four == b"\r\n\r\n");
            let head = body.map_or(0, |at| at + 4);
            answer.cut(head + bytes, *end)
        }),
        ServerAction::Paced(piece, every) => {
            for path in [MANIFEST, IMAGE] {
                server.change(path, |answer| answer.paced(*piece, *every));
            }
        }
        ServerAction::Vanishes => server.vanish(),
        ServerAction::ComesBack => server.come_back(),
    }
}
