//! Messages of an MCAP file.
use super::{BagError, BagMessage, Ending, Topic};
use crate::decode::{DecodeError, Definition};
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Length of the longest record or chunk. Unit: bytes.
const MAX_RECORD_BYTES: usize = 1 << 30;

/// Calls a function for each message, in the order of the file. The memory does not depend on the length of the file.
///
/// # Errors
/// If the file cannot be read.
pub(super) fn read(path: &Path, visit: &mut dyn FnMut(BagMessage<'_>)) -> Result<Ending, BagError> {
    let io = |source| BagError::Io { path: path.to_owned(), source };
    let mut file = File::open(path).map_err(io)?;
    let options = LinearReaderOptions::default()
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(MAX_RECORD_BYTES);
    let mut reader = LinearReader::new_with_options(options);
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
        return Ok(Ending::after(messages, &fault));
    }
    Ok(Ending::Complete)
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
