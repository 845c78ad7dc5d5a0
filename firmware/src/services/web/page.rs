//! The page: one file, compressed by `build.rs`.

use super::exchange::{Answer, Exchange, Trouble};
use super::failure::Status;
use embedded_io_async::{Read, Write};

/// `web/index.html`, compressed with gzip.
static PAGE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/index.html.gz"));
/// Most that it may take of a chip's flash.
const MAX_PAGE: usize = 40 * 1024;
/// Bytes that it takes of flash.
pub const PAGE_SIZE: usize = PAGE.len();
const _: () = assert!(PAGE_SIZE <= MAX_PAGE, "the page is too large");

/// A tag that is another one for every other page, in quotes.
pub const TAG: &str = env!("QUILL_PAGE_TAG");

const KIND: &str = "text/html; charset=utf-8";
/// Nothing may come from elsewhere, and no other page may show this one in a frame.
const HEADERS: &str = concat!(
    "Content-Encoding: gzip\r\n",
    "Cache-Control: no-cache\r\n",
    "ETag: ",
    env!("QUILL_PAGE_TAG"),
    "\r\n",
    "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; ",
    "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; ",
    "frame-ancestors 'none'\r\n",
    "Referrer-Policy: no-referrer\r\n",
);

/// Answers with the page.
pub async fn answer<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    has_page: bool,
) -> Result<(), Trouble> {
    if has_page {
        let answer = Answer {
            headers: HEADERS,
            ..Answer::default()
        };
        return exchange.head(Status::NOT_MODIFIED, answer).await;
    }
    let answer = Answer {
        kind: Some(KIND),
        length: Some(PAGE.len()),
        headers: HEADERS,
    };
    exchange.head(Status::OK, answer).await?;
    match exchange.head_only {
        true => Ok(()),
        false => exchange.push(PAGE).await,
    }
}
