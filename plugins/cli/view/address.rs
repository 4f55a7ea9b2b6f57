//! The address to listen at, from text.
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

/// Parses `HOST:PORT`, a host or a port. The host is an IP address or `localhost`, which is 127.0.0.1.
/// Default: 127.0.0.1 and port 0, which selects a free port.
///
/// # Errors
/// If the text is not such an address; the error shows examples of the expected form.
pub fn address(text: &str) -> Result<SocketAddr, String> {
    const LOCAL: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);
    let named = match text.strip_prefix("localhost").filter(|rest| rest.is_empty() || rest.starts_with(':')) {
        Some(rest) => format!("{LOCAL}{rest}"),
        None => text.to_owned(),
    };
    let host = |host: &str| host.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>().ok();
    let both = named.parse().ok();
    let port = || named.parse().ok().map(|port| SocketAddr::new(LOCAL, port));
    both.or_else(port).or_else(|| host(&named).map(|host| SocketAddr::new(host, 0))).ok_or_else(|| {
        "expected an address such as 8080, localhost:8080, 127.0.0.1:8080, [::1]:8080, or 0.0.0.0:8080 for other machines"
            .to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_or_a_port_may_be_left_out() {
        for (text, expected) in [
            ("8080", "127.0.0.1:8080"),
            ("0", "127.0.0.1:0"),
            ("localhost", "127.0.0.1:0"),
            ("localhost:80", "127.0.0.1:80"),
            ("127.0.0.1", "127.0.0.1:0"),
            ("::1", "[::1]:0"),
            ("[::1]", "[::1]:0"),
            ("[::1]:80", "[::1]:80"),
            ("0.0.0.0:8080", "0.0.0.0:8080"),
        ] {
            assert_eq!(address(text).unwrap(), expected.parse().unwrap(), "{text}");
        }
    }

    #[test]
    fn what_is_no_address_is_told() {
        for text in
            ["", "65536", "-1", "example.org", "localhost.example.org", "localhost8", "127.0.0.1:x", "1.2.3"]
        {
            assert!(address(text).unwrap_err().contains("expected an address"), "{text}");
        }
    }
}
