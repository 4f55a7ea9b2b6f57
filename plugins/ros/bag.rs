//! Messages of an MCAP file, in the order of the file.
use crate::decode::{DecodeError, Definition};
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Length of the longest record or chunk. Unit: bytes.
const MAX_RECORD_BYTES: usize = 1 << 30;
/// First bytes of an SQLite file.
const SQLITE: &[u8] = b"SQLite format 3";
/// First bytes of a recording of ROS 1.
const ROS_1: &[u8] = b"#ROSBAG";
/// First bytes of an MCAP file.
const MCAP: &[u8] = b"\x89MCAP";

/// Error that prevents reading a recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BagError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file has a different format.
    #[error("{}: expected an MCAP file, found {found}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The format, with a remedy if there is one.
        found: &'static str,
    },
}

/// A topic of a recording.
#[derive(Debug)]
pub struct Topic {
    /// Name, such as `/odom`.
    pub name: String,
    /// Type of its messages, such as `nav_msgs/msg/Odometry`.
    pub message_type: String,
    definition: Result<Definition, DecodeError>,
}

/// A message of a recording.
#[derive(Debug)]
pub struct BagMessage<'a> {
    /// Its topic.
    pub topic: &'a Topic,
    /// Time at which it was recorded. Unit: seconds.
    pub log_time: f64,
    /// Its content in the encoding of the topic.
    pub data: &'a [u8],
}

impl BagMessage<'_> {
    /// Decodes the message and reads it as a type of [`messages`](crate::messages).
    ///
    /// # Errors
    /// If the definition of its type is missing or invalid, or the content does not match it.
    pub fn decode<T: serde::de::DeserializeOwned>(&self) -> Result<T, DecodeError> {
        let definition = self.topic.definition.as_ref().map_err(Clone::clone)?;
        let value = definition.decode(self.data)?;
        serde_json::from_value(value).map_err(|error| DecodeError::Content(error.to_string()))
    }
}

/// The end of a recording.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// The file was read completely.
    Complete,
    /// The file is cut off or damaged. The messages before were read.
    Fault(String),
}

/// Calls a function for each message of an MCAP file, in the order of the file. The memory does not depend on the
/// length of the file.
///
/// # Errors
/// If the file cannot be read, or is not an MCAP file.
pub fn read(path: &Path, mut visit: impl FnMut(BagMessage<'_>)) -> Result<Ending, BagError> {
    let io = |source| BagError::Io { path: path.to_owned(), source };
    let mut file = File::open(path).map_err(io)?;
    let mut start = vec![];
    Read::by_ref(&mut file).take(SQLITE.len() as u64).read_to_end(&mut start).map_err(io)?;
    if let Some(found) = other_format(&start) {
        return Err(BagError::Format { path: path.to_owned(), found });
    }
    let options = LinearReaderOptions::default()
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(MAX_RECORD_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    reader.insert(start.len()).copy_from_slice(&start);
    reader.notify_read(start.len());
    let mut topics = Topics::default();
    let mut messages = 0_usize;
    while let Some(event) = reader.next_event() {
        let fault = match event {
            Ok(LinearReadEvent::ReadRequest(length)) => {
                let read = file.read(reader.insert(length)).map_err(io)?;
                reader.notify_read(read);
                continue;
            }
            Ok(LinearReadEvent::Record { data, opcode }) => match mcap::parse_record(opcode, data) {
                Ok(Record::Message { header, data }) => match topics.channels.get(&header.channel_id) {
                    Some(topic) => {
                        messages += 1;
                        visit(BagMessage { topic, log_time: header.log_time as f64 * 1e-9, data: &data });
                        continue;
                    }
                    None => format!("a message belongs to the unknown channel {}", header.channel_id),
                },
                Ok(record) => {
                    topics.add(record);
                    continue;
                }
                Err(error) => error.to_string(),
            },
            Err(McapError::UnexpectedEof | McapError::UnexpectedEoc) => "the file is cut off".to_owned(),
            Err(error) => error.to_string(),
        };
        return Ok(Ending::Fault(format!("{fault}, after {messages} messages")));
    }
    Ok(Ending::Complete)
}

fn other_format(start: &[u8]) -> Option<&'static str> {
    match start {
        [] => Some("an empty file"),
        start if start.starts_with(MCAP) => None,
        start if start == SQLITE => {
            Some("a recording in SQLite (db3): convert it to MCAP with `ros2 bag convert`")
        }
        start if start.starts_with(ROS_1) => {
            Some("a recording of ROS 1: convert it to MCAP with `mcap convert`")
        }
        _ => Some("something else"),
    }
}

/// Topics so far, by the number of their channel.
#[derive(Default)]
struct Topics {
    schemas: HashMap<u16, Schema>,
    channels: HashMap<u16, Topic>,
}

/// Definition of a message type, as recorded.
struct Schema {
    name: String,
    encoding: String,
    text: Vec<u8>,
}

impl Topics {
    fn add(&mut self, record: Record<'_>) {
        match record {
            Record::Schema { header, data } => {
                let schema = Schema { name: header.name, encoding: header.encoding, text: data.into_owned() };
                self.schemas.insert(header.id, schema);
            }
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => {
                let schema = self.schemas.get(&channel.schema_id);
                let message_type = schema.map_or(String::new(), |schema| schema.name.clone());
                let definition = match schema {
                    Some(Schema { name, encoding, text }) => {
                        Definition::new(name, encoding, text, &channel.message_encoding)
                    }
                    None => Err(DecodeError::NoDefinition),
                };
                self.channels.insert(channel.id, Topic { name: channel.topic, message_type, definition });
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{STRING, recording, string_message};

    #[derive(serde::Deserialize)]
    struct Text {
        data: String,
    }

    fn texts(bytes: &[u8]) -> (Vec<String>, Ending) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        let mut texts = vec![];
        let ending = read(file.path(), |message| texts.push(message.decode::<Text>().unwrap().data)).unwrap();
        (texts, ending)
    }

    #[test]
    fn a_recording_that_is_cut_off_is_read_up_to_there() {
        let sent: Vec<String> = (0..40).map(|i| format!("message {i}")).collect();
        let messages = sent.iter().zip(0..).map(|(text, i)| ("/chatter", i as f64, string_message(text)));
        let whole = recording(&[("/chatter", STRING)], messages);
        assert_eq!(texts(&whole), (sent.clone(), Ending::Complete));
        for end in (8..whole.len() - 8).step_by(61) {
            let (read, ending) = texts(&whole[..end]);
            assert_eq!(read, sent[..read.len()], "cut off at {end}");
            let Ending::Fault(fault) = ending else { panic!("cut off at {end}") };
            assert!(fault.starts_with("the file is cut off, after"), "{fault}");
        }
    }

    #[test]
    fn a_damaged_recording_is_no_reason_to_panic() {
        let messages = (0..20).map(|i| ("/chatter", f64::from(i), string_message("some text")));
        let whole = recording(&[("/chatter", STRING)], messages);
        let file = tempfile::NamedTempFile::new().unwrap();
        for place in 5..whole.len() {
            let mut damaged = whole.clone();
            damaged[place] ^= 0x55;
            std::fs::write(file.path(), &damaged).unwrap();
            let mut faults = 0;
            if let Ok(Ending::Complete) =
                read(file.path(), |m| faults += usize::from(m.decode::<Text>().is_err()))
            {
                assert!(faults <= 20);
            }
        }
    }

    #[test]
    fn other_formats_are_named() {
        for (start, words) in [
            ("SQLite format 3\0", "ros2 bag convert"),
            ("#ROSBAG V2.0\n", "ROS 1"),
            ("", "empty"),
            ("PK", "something"),
        ] {
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), start).unwrap();
            let error = read(file.path(), |_| ()).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
