//! A web server as plain as any, with files in a test's hands.

use std::io::{self, BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;

/// Serves files by their names as long as the tests run, and gives the port.
///
/// # Panics
/// When there is no port to be had.
pub fn serve(file: impl Fn(&str) -> Option<Vec<u8>> + Send + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("there is a free port");
    let port = listener.local_addr().expect("it is bound").port();
    thread::spawn(move || {
        for stream in listener.incoming() {
            // Whoever asks may have heard enough.
            let _ = stream.and_then(|stream| answer(stream, &file));
        }
    });
    port
}

fn answer(mut stream: TcpStream, file: &impl Fn(&str) -> Option<Vec<u8>>) -> io::Result<()> {
    let mut lines = BufReader::new(stream.try_clone()?).lines();
    let request = lines.next().transpose()?.unwrap_or_default();
    while lines
        .next()
        .transpose()?
        .is_some_and(|line| !line.is_empty())
    {}
    let name = request.split(' ').nth(1).unwrap_or_default();
    let content = file(name.trim_start_matches('/'));
    let status = match content {
        Some(_) => "200 OK",
        None => "404 Not Found",
    };
    let content = content.unwrap_or_default();
    write!(
        stream,
        "HTTP/1.0 {status}\r\nServer: test\r\nContent-Length: {}\r\n\r\n",
        content.len()
    )?;
    stream.write_all(&content)
}
