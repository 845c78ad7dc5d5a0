//! Drawings that the machine holds: sent, steered, given back.

use super::exchange::{Answer, Exchange, Trouble, parse};
use super::failure::{Failure, Status};
use super::request::{Request, What};
use super::state::JobState;
use crate::services::House;
use crate::services::job::NotNow;
use embedded_io_async::{Read, Write};
use protocol_core::update::Rejection;
use serde::Deserialize;

/// Takes a drawing, or a piece of one.
pub async fn upload<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    request: Request,
    house: &House,
) -> Result<(), Trouble> {
    let query = request.query;
    let length = exchange.left;
    let (mut upload, ended) = match request.what {
        What::Begin => {
            if length == 0 {
                return Err(Failure::bad_value(format_args!("the drawing is empty")).into());
            }
            if house.update.is_under_way() {
                return Err(Rejection::UnderWay.into());
            }
            let mut title = query.title;
            if title.name.is_empty() {
                let _ = title.name.push_str("drawing");
            }
            (house.job.begin(house, title, length)?, !query.more)
        }
        _ => {
            let (Some(id), Some(at)) = (query.id, query.at) else {
                let reason = format_args!("the parameters id and at are needed");
                return Err(Failure::bad_value(reason).into());
            };
            let upload = house.job.proceed(id, at as usize, length)?;
            (upload, query.last)
        }
    };
    loop {
        let piece = exchange.piece().await?;
        if piece.is_empty() {
            break;
        }
        upload.take(piece)?;
    }
    if !ended && !upload.ends_with_a_line() {
        let reason = format_args!("a piece that is not the last one must end with a whole line");
        return Err(Failure::bad_value(reason).into());
    }
    upload.keep(ended).await?;
    tell(exchange, house).await
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Pause {
    now: Option<bool>,
}

/// Pauses the drawing.
pub async fn pause<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    house: &House,
) -> Result<(), Trouble> {
    let pause: Pause = match exchange.body().await? {
        [] => Pause::default(),
        body => parse(body)?,
    };
    let outcome = house.job.pause(pause.now.unwrap_or(false));
    steer(exchange, outcome, house).await
}

/// Tells what became of a wish.
pub async fn steer<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    outcome: Result<(), NotNow>,
    house: &House,
) -> Result<(), Trouble> {
    outcome?;
    tell(exchange, house).await
}

async fn tell<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    house: &House,
) -> Result<(), Trouble> {
    let report = house.job.report().ok_or(NotNow::NoJob)?;
    exchange.json(Status::OK, &JobState::from(&report)).await
}

/// Gives the G-code back.
pub async fn give<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    house: &House,
) -> Result<(), Trouble> {
    let report = house.job.report().filter(|report| report.whole);
    let Some(report) = report else {
        let message = format_args!("no drawing is held whole");
        return Err(Failure::new(Status::NOT_FOUND, "not_found", message).into());
    };
    let answer = Answer {
        kind: Some("text/plain; charset=utf-8"),
        length: Some(report.received),
        headers: "Cache-Control: no-store\r\n",
    };
    exchange.head(Status::OK, answer).await?;
    let mut place = 0;
    while place < report.received && !exchange.head_only {
        // Another drawing may have come meanwhile: then this answer ends before its length.
        let read = house
            .job
            .read(report.id, place, exchange.room.as_mut_slice());
        let length = read.filter(|read| *read > 0).ok_or(Trouble::Gone)?;
        place += length;
        let piece = exchange.room.get(..length).unwrap_or_default();
        super::exchange::push(exchange.socket, piece).await?;
    }
    Ok(())
}
