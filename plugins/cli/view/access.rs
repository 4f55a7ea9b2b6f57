//! Access control.
use hyper::{Request, header};
use std::fmt::Write as _;
use std::io;
use std::net::{IpAddr, SocketAddr};
use subtle::ConstantTimeEq;

/// The condition that a request has to meet.
#[derive(Debug, Clone)]
pub(super) enum Access {
    /// Only programs on this machine reach the address. The request has to name it as the host: a foreign
    /// page whose name was made to resolve to it (DNS rebinding) would name its own host.
    Local,
    /// Other machines reach the address too, so a request has to contain this token.
    Token(String),
}

/// Length of a token, long enough that it cannot be guessed. Unit: bytes.
const TOKEN: usize = 16;

impl Access {
    /// Returns the access to an address, with a new token if other machines reach it.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub(super) fn to(address: SocketAddr) -> io::Result<Self> {
        if address.ip().is_loopback() {
            return Ok(Self::Local);
        }
        let mut bytes = [0; TOKEN];
        getrandom::fill(&mut bytes).map_err(io::Error::other)?;
        Ok(Self::Token(bytes.iter().fold(String::new(), |mut text, byte| {
            // writing to a String cannot fail
            let _ = write!(text, "{byte:02x}");
            text
        })))
    }

    /// The URL for a browser on this machine.
    pub(super) fn url(&self, address: SocketAddr) -> String {
        let ip = match address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => std::net::Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(ip) if ip.is_unspecified() => std::net::Ipv6Addr::LOCALHOST.into(),
            ip => ip,
        };
        let host = SocketAddr::new(ip, address.port());
        match self {
            Self::Local => format!("http://{host}/"),
            Self::Token(token) => format!("http://{host}/?token={token}"),
        }
    }

    /// Returns whether a request may be answered.
    pub(super) fn admits<T>(&self, request: &Request<T>) -> bool {
        match self {
            Self::Local => host(request).is_some_and(is_local),
            Self::Token(token) => {
                let query = request.uri().query().unwrap_or_default();
                let given = query.split('&').find_map(|pair| pair.strip_prefix("token=")).unwrap_or_default();
                // in constant time, so that the duration does not reveal a partial match
                given.as_bytes().ct_eq(token.as_bytes()).into()
            }
        }
    }
}

/// The host of a request; `None` if it has none or several.
fn host<T>(request: &Request<T>) -> Option<&str> {
    if let Some(authority) = request.uri().authority() {
        return Some(authority.as_str());
    }
    let mut hosts = request.headers().get_all(header::HOST).iter();
    hosts.next().filter(|_| hosts.next().is_none())?.to_str().ok()
}

/// Returns whether a host, with or without a port, always means this machine, without a name server.
fn is_local(host: &str) -> bool {
    let port = |rest: &str| {
        // RFC 3986: a port is digits, and there may be none after the colon
        let is_port = |port: &str| {
            port.is_empty() || (port.bytes().all(|b| b.is_ascii_digit()) && port.parse::<u16>().is_ok())
        };
        rest.is_empty() || rest.strip_prefix(':').is_some_and(is_port)
    };
    let (name, rest) = match host.strip_prefix('[').and_then(|inner| inner.split_once(']')) {
        Some(parts) => parts,
        None => host.split_at(host.find(':').unwrap_or(host.len())),
    };
    let is_loopback = name.parse().is_ok_and(|ip: IpAddr| ip.is_loopback());
    port(rest) && (is_loopback || name.eq_ignore_ascii_case("localhost"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_of_this_machine_are_local() {
        for host in [
            "localhost",
            "LocalHost:80",
            "127.0.0.1",
            "127.0.0.1:8080",
            "127.1.2.3:1",
            "[::1]",
            "[::1]:80",
            "localhost:",
        ] {
            assert!(is_local(host), "{host}");
        }
    }

    #[test]
    fn other_hosts_are_not() {
        for host in [
            "",
            "example.org",
            "localhost.example.org",
            "127.0.0.1.example.org",
            "127.0.0.1:80.example.org",
            "[::1].example.org",
            "[::1",
            "0.0.0.0",
            "192.168.0.1",
            "[::2]:80",
            "user@127.0.0.1",
            "localhost:+80",
            "localhost:65536",
        ] {
            assert!(!is_local(host), "{host}");
        }
    }

    #[test]
    fn of_two_hosts_neither_counts() {
        let admitted = |target: &str, hosts: &[&str]| {
            let request = hosts.iter().fold(Request::get(target), |to, host| to.header(header::HOST, *host));
            Access::Local.admits(&request.body(()).unwrap())
        };
        assert!(admitted("/", &["localhost:80"]) && admitted("http://localhost/", &[]));
        assert!(!admitted("/", &[]) && !admitted("/", &["localhost", "localhost"]));
        // the host in the request line has priority over the header
        assert!(!admitted("http://example.org/", &["localhost"]));
    }

    #[test]
    fn a_token_is_asked_for_where_others_reach_the_address() {
        let to = |address: &str| Access::to(address.parse().unwrap()).unwrap();
        for address in ["127.0.0.1:80", "[::1]:80"] {
            assert!(matches!(to(address), Access::Local));
        }
        let tokens = ["0.0.0.0:80", "[::]:80", "192.168.0.1:80"].map(|address| match to(address) {
            Access::Token(token) => token,
            Access::Local => panic!("{address} without a token"),
        });
        assert!(tokens.iter().all(|token| token.len() == 2 * TOKEN) && tokens[0] != tokens[1]);
        let everywhere: SocketAddr = "0.0.0.0:80".parse().unwrap();
        assert_eq!(Access::Token("abc".to_owned()).url(everywhere), "http://127.0.0.1:80/?token=abc");
    }
}
