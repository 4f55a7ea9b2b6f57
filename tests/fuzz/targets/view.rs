//! The live view: its address, and requests to its server.
use manifactor_cli::__private::{address, answer};

/// A token of the length that the server uses.
const TOKEN: &str = "0123456789abcdef0123456789abcdef";
/// Statuses of the server and of its library.
const STATUSES: [&str; 8] = ["200", "400", "403", "404", "405", "414", "431", "505"];
/// Headers of each answer of the server.
const HEADERS: [&str; 3] =
    ["cache-control: no-store", "referrer-policy: no-referrer", "frame-ancestors 'none'"];

/// Reads an address from the first line, and sends the rest to the server. An address is read back. The server shows the map only to
/// requests with the token, or with the name of this machine if there is no token.
pub fn view(data: &[u8]) {
    let first = data.iter().position(|byte| *byte == b'\n').unwrap_or(data.len());
    let (line, request) = (&data[..first], data.get(first + 1..).unwrap_or_default());
    if let Ok(found) = address(&String::from_utf8_lossy(line)) {
        assert_eq!(address(&found.to_string()), Ok(found));
    }
    for token in [None, Some(TOKEN)] {
        let text = answer(request, token).unwrap_or_else(|e| panic!("{e}"));
        let text = String::from_utf8_lossy(&text);
        let Some((head, _)) = text.split_once("\r\n\r\n") else {
            assert!(text.is_empty(), "half a head: {text}");
            continue;
        };
        let status = head.strip_prefix("HTTP/1.").and_then(|rest| rest.get(2..5)).unwrap_or_default();
        assert!(STATUSES.contains(&status), "{head}");
        if ["200", "403", "404", "405"].contains(&status) {
            assert!(HEADERS.iter().all(|header| head.contains(header)), "{head}");
        }
        if status == "200" {
            let asked = String::from_utf8_lossy(request).to_ascii_lowercase();
            let is_admitted = match token {
                Some(token) => asked.contains(&format!("token={token}")),
                None => ["localhost", "127.", "[", "::1"].iter().any(|host| asked.contains(host)),
            };
            assert!(is_admitted && asked.contains("get "), "admitted: {asked}");
        }
    }
}
