//! What comes in, from a server or from whoever hands it over: so many bytes within so much time.

use super::offer::Bytes;
use super::{duration, now};
use embassy_time::with_timeout;
use embedded_io_async::Read;
use protocol_core::update::{Download, Rejection};

/// Where bytes come from.
pub enum Origin<'a, S> {
    /// A server's connection.
    Server(S),
    /// What is handed over.
    Offer(Bytes<'a>),
}

/// Something on its way.
pub struct Body<'a, S> {
    origin: Origin<'a, S>,
    download: Download,
}

impl<'a, S: Read> Body<'a, S> {
    /// Of a download that has begun, and whose length is known.
    pub const fn new(origin: Origin<'a, S>, download: Download) -> Self {
        Self { origin, download }
    }

    /// Bytes of all of it.
    pub const fn length(&self) -> u32 {
        self.download.expected()
    }

    /// How much has come, in percent.
    pub fn percent(&self) -> u8 {
        self.download.percent()
    }

    /// The next bytes, at least one; 0 when all have come.
    pub async fn read(&mut self, into: &mut [u8]) -> Result<usize, Rejection> {
        let most = into.len().min(self.download.missing() as usize);
        let Some(into @ [_, ..]) = into.get_mut(..most) else {
            return Ok(0);
        };
        let patience = duration(self.download.patience(now())?);
        let reading = async {
            match &mut self.origin {
                // A connection that breaks has ended.
                Origin::Server(socket) => socket.read(into).await.unwrap_or(0),
                Origin::Offer(bytes) => bytes.read(into).await,
            }
        };
        let Ok(count) = with_timeout(patience, reading).await else {
            return Err(self.download.timed_out(now()));
        };
        self.download.take(count as u32)?;
        Ok(count)
    }
}
