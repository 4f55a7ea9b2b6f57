//! Who may look.
use hyper::{Request, header};
use std::fmt::Write as _;
use std::io;
use std::net::{IpAddr, SocketAddr};
use subtle::ConstantTimeEq;

/// What a request has to show.
#[derive(Debug, Clone)]
pub(super) enum Access {
    /// Programs of this machine alone reach the address. The request has to name it as such: a page of somebody else's whose
    /// name was made to lead here (DNS rebinding) would name its own host.
    Local,
    /// Others reach it as well: they have to know this.
    Token(String),
}

/// Bytes of a token: as many as cannot be guessed.
const TOKEN: usize = 16;

impl Access {
    /// That to an address; a new token for one that others reach.
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
            // writing to a String does not fail
            let _ = write!(text, "{byte:02x}");
            text
        })))
    }

    /// What to open in a browser of this machine.
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
                // in a time that tells nothing of how much of it is right
                given.as_bytes().ct_eq(token.as_bytes()).into()
            }
        }
    }
}

/// The host that a request names; `None` for none or several.
fn host<T>(request: &Request<T>) -> Option<&str> {
    if let Some(authority) = request.uri().authority() {
        return Some(authority.as_str());
    }
    let mut hosts = request.headers().get_all(header::HOST).iter();
    hosts.next().filter(|_| hosts.next().is_none())?.to_str().ok()
}

/// Returns whether a host, with its port or without, is this machine by its nature: no name server is asked about these.
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
        // what is asked for says more than the header
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
