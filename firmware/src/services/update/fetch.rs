//! A small and strict client of HTTP: GET, status 200, a length, no more and no less.
//!
//! The heads are read by `httparse`. The client of `edge-http` 0.8, which is built on it, panics where a
//! server sends a length that is no number (`Headers::content_len`).

use super::body::{Body, Origin};
use super::{duration, now};
use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use edge_nal::{AddrType, Dns, TcpConnect};
use embassy_time::with_timeout;
use embedded_io_async::{Read, Write};
use httparse::{EMPTY_HEADER, Response};
use protocol_core::motion::Micros;
use protocol_core::update::{
    Download, Head, IMAGE_TIME, ImageName, MANIFEST_TIME, MAX_HEAD, MAX_HEADERS, MAX_MANIFEST,
    ManifestAddress, Rejection, SILENCE,
};

/// What ends a head.
const END: &[u8] = b"\r\n\r\n";

/// The server of an address.
pub struct Server<'a, N> {
    network: &'a N,
    address: &'a ManifestAddress,
    place: SocketAddr,
}

impl<'a, N: TcpConnect + Dns> Server<'a, N> {
    /// Finds it.
    pub async fn find(network: &'a N, address: &'a ManifestAddress) -> Result<Self, Rejection> {
        let host = address.host();
        let ip = match host.parse::<Ipv4Addr>() {
            Ok(ip) => IpAddr::V4(ip),
            Err(_) => {
                let named = network.get_host_by_name(host, AddrType::IPv4);
                let named = with_timeout(duration(SILENCE), named).await;
                named
                    .ok()
                    .and_then(Result::ok)
                    .ok_or(Rejection::UnknownHost)?
            }
        };
        Ok(Self {
            network,
            address,
            place: SocketAddr::new(ip, address.port()),
        })
    }

    /// Fetches the manifest.
    pub async fn manifest<'b>(
        &self,
        text: &'b mut [u8; MAX_MANIFEST],
    ) -> Result<&'b [u8], Rejection> {
        let mut body = self.get(self.address.path(), MANIFEST_TIME).await?;
        let long = Rejection::LongManifest(body.length());
        let text = text.get_mut(..body.length() as usize).ok_or(long)?;
        let mut filled = 0;
        while let Some(free @ [_, ..]) = text.get_mut(filled..) {
            filled += body.read(free).await?;
        }
        Ok(text)
    }

    /// Asks for the image beside the manifest.
    pub async fn image(&self, name: &ImageName) -> Result<Body<'_, N::Socket<'_>>, Rejection> {
        self.get(&self.address.beside(name), IMAGE_TIME).await
    }

    /// Asks for a file; all of it has to come within `limit`.
    async fn get(&self, path: &str, limit: Micros) -> Result<Body<'_, N::Socket<'_>>, Rejection> {
        let download = Download::begin(now(), limit);
        let ask = async {
            let connection = with_timeout(duration(SILENCE), self.network.connect(self.place));
            let mut socket = match connection.await {
                Ok(Ok(socket)) => socket,
                _ => return Err(Rejection::NoServer),
            };
            let asked = self.ask(path, &mut socket).await;
            asked.map_err(|_| Rejection::NoAnswer)?;
            let length = head(&mut socket).await?;
            Ok((socket, length))
        };
        match with_timeout(duration(MANIFEST_TIME), ask).await {
            Ok(answer) => {
                let (socket, length) = answer?;
                Ok(Body::new(Origin::Server(socket), download.of(length)))
            }
            Err(_) => Err(Rejection::Silent),
        }
    }

    async fn ask<S: Write>(&self, path: &str, socket: &mut S) -> Result<(), S::Error> {
        let mut port = heapless::String::<8>::new();
        // It fits: a colon and five digits.
        let _ = core::fmt::write(&mut port, format_args!(":{}", self.address.port()));
        for part in [
            "GET ",
            path,
            " HTTP/1.1\r\nHost: ",
            self.address.host(),
            &port,
            "\r\nUser-Agent: Quill\r\nAccept-Encoding: identity\r\nConnection: close\r\n\r\n",
        ] {
            socket.write_all(part.as_bytes()).await?;
        }
        socket.flush().await
    }
}

/// Reads the head of an answer and gives the length of what follows.
async fn head<S: Read>(socket: &mut S) -> Result<u32, Rejection> {
    let mut bytes = [0; MAX_HEAD];
    let mut length = 0;
    // One by one, so that none of what follows is taken.
    while !bytes.get(..length).unwrap_or_default().ends_with(END) {
        let place = bytes.get_mut(length..=length).ok_or(Rejection::NotHttp)?;
        match socket.read(place).await {
            Ok(1..) => length += 1,
            _ => return Err(Rejection::NoAnswer),
        }
    }
    let mut headers = [EMPTY_HEADER; MAX_HEADERS];
    let mut response = Response::new(&mut headers);
    let parsed = response.parse(bytes.get(..length).unwrap_or_default());
    let status = match (parsed, response.code) {
        (Ok(status), Some(code)) if status.is_complete() => code,
        _ => return Err(Rejection::NotHttp),
    };
    let mut head = Head::new(status);
    for header in response.headers.iter() {
        head.header(header.name, header.value);
    }
    head.length()
}
