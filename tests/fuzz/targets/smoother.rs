//! Saved sessions, with a checksum that fits the damaged document.
use super::is_finite;
use manifactor::smoother::Smoother;

/// Loads saved sessions, unchanged and with a valid checksum. A loaded session is finite, and continues bit
/// for bit after a second restart.
pub fn session(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    for text in [text.to_string(), resealed(&text)] {
        let Ok(mut session) = Smoother::load(&text) else { continue };
        is_finite(&session.estimates());
        let saved = save(&session);
        let mut again = load(&saved);
        assert_eq!(save(&again), saved);
        assert_eq!(session.update().is_ok(), again.update().is_ok());
        is_finite(&session.estimates());
        assert_eq!(save(&session), save(&again), "a session does not go on as before its restart");
        let (graph, _) = session.graph();
        assert!(graph.factors().iter().all(|entry| !entry.keys.is_empty()));
    }
}

fn load(text: &str) -> Smoother {
    Smoother::load(text).unwrap_or_else(|e| panic!("{e}"))
}

fn save(session: &Smoother) -> String {
    session.save().unwrap_or_else(|e| panic!("{e}"))
}

/// Writes the checksum of the document into the first line.
fn resealed(text: &str) -> String {
    let Some((head, json)) = text.split_once('\n') else { return text.to_owned() };
    let json = json.trim_end();
    let fnv = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let checksum = json.bytes().fold(0xcbf2_9ce4_8422_2325, fnv);
    let words: Vec<&str> = head.split_whitespace().take(3).collect();
    format!("{} {checksum:016x}\n{json}\n", words.join(" "))
}
