//! The view server without sockets and without a clock, for fuzz targets.
use super::access::Access;
use super::answers::Answers;
use super::server::http;
use hyper::rt::{Read, ReadBufCursor, Write};
use hyper::service::service_fn;
use manifactor::viz::LiveMap;
use std::cell::RefCell;
use std::convert::Infallible;
use std::future::{Future, poll_fn, ready};
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use tokio::runtime;
use tokio::sync::watch;

/// Number of polls of the connection. One poll answers a complete request.
const POLLS: usize = 8;

/// Returns the bytes that the server sends immediately on a connection with these bytes. With a token,
/// every request needs it; without one, every request has to name this machine as the host. An incomplete
/// request has no response yet, and a response with events has no end.
///
/// # Errors
/// If the system has no timer.
pub fn answer(request: &[u8], token: Option<&str>) -> io::Result<Vec<u8>> {
    let access = token.map_or(Access::Local, |token| Access::Token(token.to_owned()));
    let (_states, receiver) = watch::channel(Arc::new(LiveMap::new("desk", "only")));
    let answers = Answers::new(access, receiver);
    let sent = RefCell::new(vec![]);
    let runtime = runtime::Builder::new_current_thread().enable_time().build()?;
    runtime.block_on(async {
        let connection = Memory { request, sent: &sent };
        let service = service_fn(|request| ready(Ok::<_, Infallible>(answers.to(&request))));
        let mut connection = http().serve_connection(connection, service);
        for _ in 0..POLLS {
            let polled = poll_fn(|context| Poll::Ready(Pin::new(&mut connection).poll(context))).await;
            if polled.is_ready() {
                break;
            }
        }
    });
    Ok(sent.into_inner())
}

/// A connection whose peer has sent all of its bytes and waits.
struct Memory<'a> {
    request: &'a [u8],
    sent: &'a RefCell<Vec<u8>>,
}

impl Read for Memory<'_> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        _: &mut Context<'_>,
        mut buffer: ReadBufCursor<'_>,
    ) -> Poll<io::Result<()>> {
        if self.request.is_empty() {
            return Poll::Pending;
        }
        let (now, later) = self.request.split_at(self.request.len().min(buffer.remaining()));
        buffer.put_slice(now);
        self.request = later;
        Poll::Ready(Ok(()))
    }
}

impl Write for Memory<'_> {
    fn poll_write(self: Pin<&mut Self>, _: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        self.sent.borrow_mut().extend_from_slice(bytes);
        Poll::Ready(Ok(bytes.len()))
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use super::answer;

    fn status(request: &str, token: Option<&str>) -> String {
        let text = String::from_utf8(answer(request.as_bytes(), token).unwrap()).unwrap();
        text.lines().next().unwrap_or_default().to_owned()
    }

    #[test]
    fn a_connection_in_memory_is_answered_as_one_of_a_browser() {
        let get = |path: &str| format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n");
        assert_eq!(status(&get("/"), None), "HTTP/1.1 200 OK");
        assert_eq!(status(&get("/events"), None), "HTTP/1.1 200 OK");
        assert_eq!(status(&get("/x"), None), "HTTP/1.1 404 Not Found");
        assert_eq!(status(&get("/"), Some("7")), "HTTP/1.1 403 Forbidden");
        assert_eq!(status(&get("/?token=7"), Some("7")), "HTTP/1.1 200 OK");
        assert_eq!(status("GET / HTTP/1.1\r\nHost: local", None), "");
    }
}
