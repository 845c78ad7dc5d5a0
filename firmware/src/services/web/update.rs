//! New firmware from a file: the manifest, then the image.

use super::exchange::{Exchange, Trouble};
use super::failure::{Failure, Status};
use super::state::Words;
use crate::services::House;
use embassy_futures::select::{Either, select};
use embassy_time::Duration;
use embedded_io_async::{Read, Write};
use heapless::Vec;
use protocol_core::update::{ARM_TIME, IMAGE_TIME, MAX_MANIFEST, Rejection, Version, manifest_end};
use serde::Serialize;

/// How long all of it may take: the arm has to come to rest, the file to arrive, and to be read back.
pub const IN_ALL: Duration = Duration::from_micros(ARM_TIME.get() + IMAGE_TIME.get() + 60_000_000);

#[derive(Serialize)]
struct Starting {
    version: Words<Version>,
}

/// Takes a file and hands it to the update service, which looks at it as at one from a server.
pub async fn take<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    house: &House,
) -> Result<(), Trouble> {
    let outcome = hand_over(exchange, house).await;
    if let Err(Trouble::Failure(_)) = outcome {
        // A client that is still sending would not hear why.
        while let Ok([_, ..]) = exchange.piece().await {}
    }
    let version = Words(outcome?);
    exchange.json(Status::OK, &Starting { version }).await
}

async fn hand_over<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    house: &House,
) -> Result<Version, Trouble> {
    let total = exchange.left;
    let mut manifest = Vec::<u8, MAX_MANIFEST>::new();
    let end = loop {
        let piece = exchange.piece().await?;
        let (before, taken) = (manifest.len(), piece.len());
        let fits = taken.min(MAX_MANIFEST - before);
        let _ = manifest.extend_from_slice(piece.get(..fits).unwrap_or_default());
        let end = manifest_end(&manifest);
        if end.is_some() || taken == 0 || manifest.is_full() {
            // What is no manifest is refused as one by the service.
            let end = end.unwrap_or(manifest.len());
            exchange.put_back(end.saturating_sub(before)..taken);
            break end;
        }
    };
    let text = manifest.get(..end).unwrap_or_default();
    let length = u32::try_from(total.saturating_sub(end)).unwrap_or(u32::MAX);
    let handover = house.update.offer(text, length)?;
    let image = async {
        loop {
            match exchange.piece().await? {
                [] => return Ok(()),
                piece => handover.push(piece).await,
            }
        }
    };
    match select(handover.outcome(), image).await {
        Either::First(outcome) => Ok(outcome?),
        Either::Second(Ok(())) => Ok(handover.outcome().await?),
        Either::Second(Err(trouble)) => Err(trouble),
    }
}

impl From<Rejection> for Failure {
    fn from(rejection: Rejection) -> Self {
        let (status, error) = match rejection {
            Rejection::UnderWay | Rejection::OnTrial | Rejection::Drawing => {
                (Status::CONFLICT, "busy")
            }
            Rejection::FlashDiffers | Rejection::FlashFails => (Status::SERVER_ERROR, "not_stored"),
            _ => (Status::UNPROCESSABLE, "refused_update"),
        };
        Self::new(status, error, format_args!("{rejection}"))
    }
}
