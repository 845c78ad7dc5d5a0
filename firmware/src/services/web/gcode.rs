//! G-code over a WebSocket: a command a message, a reply a message, without terminators.

use super::exchange::Room;
use super::frames::{Event, Frames, MAX_HEAD, put};
use crate::services::House;
use crate::services::line_us::{Answers, answer};
use edge_ws::FrameType;
use embassy_futures::yield_now;
use embedded_io_async::{Read, Write};
use heapless::Vec;
use protocol_core::lineus::{MAX_REPLY, Reply, Session};
use protocol_core::machine::Client;

/// A reply without its terminator, in its frame.
type Frame = Vec<u8, { MAX_REPLY + MAX_HEAD }>;

/// Serves one client until it has closed. `here` bytes from it are in the room.
pub async fn serve<S: Read + Write>(
    socket: S,
    room: &mut Room,
    here: usize,
    client: Client,
    house: &House,
) {
    house.greet_first_client().await;
    let mut session = Session::web_socket();
    let mut reply = Reply::new();
    let mut frame = Frame::new();
    let mut answers: Answers<S, { MAX_REPLY + MAX_HEAD }> = Answers::new(socket);
    let mut frames = Frames::new();
    reply.hello(&house.name(), house.identity);
    put(
        &mut frame,
        FrameType::Text(false),
        reply.message().as_bytes(),
    );
    answers.send_message(&frame).await;
    let mut length = here;
    loop {
        let mut input = room.get_mut(..length).unwrap_or_default();
        loop {
            let text: &[u8] = match frames.next(&mut input) {
                Ok(None) => break,
                Ok(Some(Event::Text(text))) => text,
                Ok(Some(Event::End)) => b"\n",
                Ok(Some(Event::Ping(content))) => {
                    put(&mut frame, FrameType::Pong, &content);
                    answers.send_message(&frame).await;
                    continue;
                }
                Err(code) => {
                    put(&mut frame, FrameType::Close, &code.0.to_be_bytes());
                    return answers.send_message(&frame).await;
                }
            };
            let mut line = text;
            while let Some(request) = session.next_request(&mut line, &mut reply) {
                answer(&request, &mut session, &mut reply, client, house).await;
                put(
                    &mut frame,
                    FrameType::Text(false),
                    reply.message().as_bytes(),
                );
                answers.send_message(&frame).await;
            }
        }
        // A client that sends faster than it is served would else keep everybody waiting.
        yield_now().await;
        match answers.read(room).await {
            Ok(read @ 1..) => length = read,
            _ => return,
        }
    }
}
