//! What a browser asks for.
use std::io::{ErrorKind, Read};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// The head of a request. What may follow it is not read: nothing here takes any.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Request {
    /// Such as GET.
    pub method: String,
    /// Without the query.
    pub path: String,
    /// The query's `token`.
    pub token: Option<String>,
    /// The host that it names; `None` for none or several.
    pub host: Option<String>,
}

/// Why there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum NoRequest {
    /// It is not HTTP.
    Malformed,
    /// It is longer than any browser's.
    TooLong,
    /// It does not come, or not in time.
    Gone,
}

/// Bytes of a head at most.
const LONGEST: usize = 16 * 1024;
/// Headers at most.
const HEADERS: usize = 100;
/// How long a head may take to come.
const PATIENCE: Duration = Duration::from_secs(10);

impl Request {
    /// Reads the head of a request.
    pub(super) fn read(stream: &mut TcpStream) -> Result<Self, NoRequest> {
        let (mut bytes, mut part, began) = (vec![], [0; 2048], Instant::now());
        loop {
            let left = PATIENCE.checked_sub(began.elapsed()).filter(|left| !left.is_zero());
            stream.set_read_timeout(Some(left.ok_or(NoRequest::Gone)?)).map_err(|_| NoRequest::Gone)?;
            let read = match stream.read(&mut part) {
                Ok(0) => return Err(NoRequest::Gone),
                Ok(read) => read,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(_) => return Err(NoRequest::Gone),
            };
            bytes.extend(part.iter().take(read));
            match Self::parse(&bytes)? {
                Some(request) => return Ok(request),
                None if bytes.len() > LONGEST => return Err(NoRequest::TooLong),
                None => {}
            }
        }
    }

    /// `None` while there is more to come.
    fn parse(bytes: &[u8]) -> Result<Option<Self>, NoRequest> {
        let mut headers = [httparse::EMPTY_HEADER; HEADERS];
        let mut head = httparse::Request::new(&mut headers);
        match head.parse(bytes) {
            Ok(httparse::Status::Complete(_)) => {}
            Ok(httparse::Status::Partial) => return Ok(None),
            Err(httparse::Error::TooManyHeaders) => return Err(NoRequest::TooLong),
            Err(_) => return Err(NoRequest::Malformed),
        }
        let target = head.path.unwrap_or_default();
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let mut hosts = head.headers.iter().filter(|header| header.name.eq_ignore_ascii_case("host"));
        let host = hosts.next().filter(|_| hosts.next().is_none());
        Ok(Some(Self {
            method: head.method.unwrap_or_default().to_owned(),
            path: path.to_owned(),
            token: query.split('&').find_map(|pair| pair.strip_prefix("token=")).map(str::to_owned),
            host: host.and_then(|host| String::from_utf8(host.value.to_vec()).ok()),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Option<Request> {
        Request::parse(text.as_bytes()).unwrap()
    }

    #[test]
    fn a_request_has_a_path_a_token_and_a_host() {
        let request = parsed("GET /events?x=1&token=abc HTTP/1.1\r\nhost: localhost:80\r\n\r\n").unwrap();
        assert_eq!((request.method.as_str(), request.path.as_str()), ("GET", "/events"));
        assert_eq!((request.token.as_deref(), request.host.as_deref()), (Some("abc"), Some("localhost:80")));
        let bare = parsed("POST / HTTP/1.0\r\n\r\n").unwrap();
        assert_eq!(bare, Request { method: "POST".into(), path: "/".into(), ..Request::default() });
    }

    #[test]
    fn of_two_hosts_neither_counts() {
        let request = parsed("GET / HTTP/1.1\r\nHost: localhost\r\nHost: example.org\r\n\r\n").unwrap();
        assert_eq!(request.host, None);
    }

    #[test]
    fn what_is_not_all_there_is_waited_for_and_what_is_no_http_refused() {
        assert_eq!(parsed("GET / HTTP/1.1\r\nHost: local"), None);
        assert_eq!(Request::parse(b"\x16\x03\x01\x02"), Err(NoRequest::Malformed));
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "a: b\r\n".repeat(HEADERS + 1));
        assert_eq!(Request::parse(many.as_bytes()), Err(NoRequest::TooLong));
    }
}
