//! What a line asks for about stored drawings is done here.

use crate::services::House;
use crate::services::drawings::{AlbumError, Recorded};
use protocol_core::drawings::Slot;
use protocol_core::lineus::{Refusal, Reply, Request, Session};
use protocol_core::machine::Client;

/// Does what belongs to a recording, and puts the answer into `reply`; says whether it was that.
pub(super) async fn record(
    request: &Request,
    session: &mut Session,
    reply: &mut Reply,
    client: Client,
    house: &House,
) -> bool {
    let drawings = &house.drawings;
    match request {
        Request::BeginRecording(slot) => match drawings.begin(client, *slot).await {
            Ok(()) => {
                session.record(true);
                reply.ok();
            }
            Err(error) => reply.error(format_args!("{error}")),
        },
        Request::RecordLine => {
            let line = session.recorded_line();
            match drawings.record(client, line, &house.arm).await {
                Ok(Recorded::AtOnce) => reply.ok(),
                Ok(Recorded::AfterRest) => reply.ok_with(format_args!(
                    "the buffer was full: waited until the arm rested"
                )),
                Err(error) => reply.error(format_args!(
                    "not recorded, nor is anything more of this drawing: {error}"
                )),
            }
        }
        Request::EndRecording if session.is_recording() => {
            session.record(false);
            match drawings.end(client, &house.arm).await {
                Ok(_) => reply.ok(),
                Err(error) => reply.error(format_args!(
                    "the drawing is not stored, what was there before is: {error}"
                )),
            }
        }
        _ => return false,
    }
    true
}

/// Does what a line asks for, and puts the answer into `reply`.
pub(super) async fn perform(request: &Request, reply: &mut Reply, client: Client, house: &House) {
    let drawings = &house.drawings;
    match request {
        Request::Drawings => reply.drawings(&drawings.contents()),
        Request::Space => reply.space(drawings.space()),
        Request::Draw(slot) => {
            if !is_stored(*slot, house) {
                return reply.refuse(&Refusal::NoSuchDrawing(*slot));
            }
            match house.drawer.draw(*slot) {
                Ok(()) => reply.ok(),
                Err(busy) => reply.error(format_args!("{busy}")),
            }
        }
        Request::StopDrawing => {
            house.drawer.stop();
            reply.ok();
        }
        Request::Delete(slot) => match drawings.delete(*slot, client, &house.arm).await {
            Ok(()) => reply.ok(),
            Err(AlbumError::Gone) => reply.refuse(&Refusal::NoSuchDrawing(*slot)),
            Err(error) => reply.error(format_args!("the drawing is not deleted: {error}")),
        },
        Request::Replaying => reply.replay(house.drawer.replay()),
        Request::SetReplay(replay) => {
            if let Some(replay) = replay
                && !is_stored(replay.slot, house)
            {
                return reply.refuse(&Refusal::NoSuchDrawing(replay.slot));
            }
            house.drawer.set_replay(*replay);
            reply.ok();
        }
        // Of a connection that does not record.
        _ => reply.error(format_args!("nothing is recorded: M28 begins that")),
    }
}

fn is_stored(slot: Slot, house: &House) -> bool {
    house.drawings.contents().bytes(slot).is_some()
}
