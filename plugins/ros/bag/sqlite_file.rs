//! Messages of an SQLite file (db3), the format of ROS 2 up to Humble.
use super::{BagError, BagMessage, Ending, Topic};
use crate::decode::{DecodeError, Definition};
use crate::definitions;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Encoding of definitions that a file does not name.
const DEFINITION_ENCODING: &str = "ros2msg";

/// Calls a function for each message, in the order in which they were recorded. The memory does not depend on the length
/// of the file.
///
/// # Errors
/// If the file cannot be opened, or is not a recording of ROS 2.
pub(super) fn read(path: &Path, visit: &mut dyn FnMut(BagMessage<'_>)) -> Result<Ending, BagError> {
    let failed = |source| BagError::Database { path: path.to_owned(), source };
    let database = open(path).map_err(failed)?;
    let has_table = |name: &str| {
        let query = "SELECT EXISTS (SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?1)";
        database.query_row(query, [name], |row| row.get::<_, bool>(0)).map_err(failed)
    };
    if !has_table("topics")? || !has_table("messages")? {
        let found = "an SQLite file without the tables `topics` and `messages`";
        return Err(BagError::Format { path: path.to_owned(), found });
    }
    let own = if has_table("message_definitions")? {
        own_definitions(&database).map_err(failed)?
    } else {
        HashMap::new()
    };
    let topics = topics(&database, &own).map_err(failed)?;
    let mut messages = 0_usize;
    let fault = match visit_messages(&database, &topics, &mut messages, visit) {
        Ok(None) => match not_in_the_file(path) {
            Some(rest) => format!(
                "the recording did not end regularly, and its last messages are in {}: copy both files, and run `sqlite3 COPY \
                 'PRAGMA wal_checkpoint'`",
                rest.display()
            ),
            None => return Ok(Ending::Complete),
        },
        Ok(Some(fault)) => fault,
        Err(error) => format!("the database is damaged or cut off: {error}"),
    };
    Ok(Ending::after(messages, &fault))
}

/// Opens a file without writing anything beside it.
fn open(path: &Path) -> rusqlite::Result<Connection> {
    let flags =
        OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    // the characters with a meaning in the address
    let name = path.to_string_lossy().replace('%', "%25").replace('?', "%3f").replace('#', "%23");
    let database = Connection::open_with_flags(format!("file:{name}?immutable=1"), flags)?;
    // otherwise nothing is read of a file that is cut off
    database.pragma_update(None, "writable_schema", true)?;
    Ok(database)
}

/// Returns the file with messages that SQLite has not moved to the database, if there are any.
fn not_in_the_file(path: &Path) -> Option<PathBuf> {
    let mut name = path.as_os_str().to_owned();
    name.push("-wal");
    let rest = PathBuf::from(name);
    std::fs::metadata(&rest).is_ok_and(|found| found.len() > 0).then_some(rest)
}

/// Returns the encoding and the text of each definition, by message type.
fn own_definitions(database: &Connection) -> rusqlite::Result<HashMap<String, (String, String)>> {
    let mut query = database
        .prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")?;
    let rows = query.query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?;
    rows.collect()
}

/// Returns the topics by their id.
fn topics(
    database: &Connection,
    own: &HashMap<String, (String, String)>,
) -> rusqlite::Result<HashMap<i64, Topic>> {
    let mut query = database.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let rows = query.query_map([], |row| {
        Ok((
            row.get::<_, i64>(0)?,
            row.get::<_, String>(1)?,
            row.get::<_, String>(2)?,
            row.get::<_, String>(3)?,
        ))
    })?;
    let topic = |row| {
        let (id, name, message_type, message_encoding): (i64, String, String, String) = row?;
        let recorded = own.get(&message_type).filter(|(_, text)| !text.is_empty());
        let definition = match recorded {
            Some((encoding, text)) => {
                Definition::new(&message_type, encoding, text.as_bytes(), &message_encoding)
            }
            None => match definitions::of(&message_type) {
                Some(text) => {
                    Definition::new(&message_type, DEFINITION_ENCODING, text.as_bytes(), &message_encoding)
                        .map(Definition::assumed)
                }
                None => Err(DecodeError::NoDefinition),
            },
        };
        Ok((id, Topic { name, message_type, definition }))
    };
    rows.map(topic).collect()
}

/// Visits the messages and counts them. Returns a fault of the content.
fn visit_messages(
    database: &Connection,
    topics: &HashMap<i64, Topic>,
    messages: &mut usize,
    visit: &mut dyn FnMut(BagMessage<'_>),
) -> rusqlite::Result<Option<String>> {
    let mut query = database.prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY id")?;
    let mut rows = query.query([])?;
    while let Some(row) = rows.next()? {
        let (topic, time): (i64, i64) = (row.get(0)?, row.get(1)?);
        let Some(topic) = topics.get(&topic) else {
            return Ok(Some(format!("a message belongs to the unknown topic {topic}")));
        };
        let ValueRef::Blob(data) = row.get_ref(2)? else {
            return Ok(Some(format!("a message of `{}` has no data", topic.name)));
        };
        *messages += 1;
        visit(BagMessage { topic, log_time: time as f64 * 1e-9, data });
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bag::read;
    use crate::messages::FramedPose;
    use crate::testing::{ODOMETRY, STRING, database, odometry_message, string_message};
    use manifactor_geometry::{Se3, So3};
    use nalgebra::Vector3;

    fn pose(x: f64) -> Se3 {
        Se3::new(So3::identity(), Vector3::new(x, 0.0, 0.0))
    }

    /// Returns the positions and the faults of messages.
    fn positions(path: &Path) -> (Vec<f64>, Vec<String>, Ending) {
        let (mut found, mut faults) = (vec![], vec![]);
        let ending = read(path, |message| match FramedPose::of(&message) {
            Some(Ok(framed)) => found.push(framed.pose.to_se3().unwrap().translation.x),
            Some(Err(error)) => faults.push(error.to_string()),
            None => {}
        });
        (found, faults, ending.unwrap())
    }

    #[test]
    fn messages_are_read_with_and_without_recorded_definitions() {
        let sent = (0..9_u32).map(|i| {
            ("/odom", f64::from(i), odometry_message(f64::from(i), "odom", "base", &pose(i.into())))
        });
        let texts = [("/chatter", 0.5, string_message("hello"))];
        let all: Vec<_> = sent.chain(texts).collect();
        for with_definitions in [true, false] {
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("drive_0.db3");
            database(&file, &[("/odom", ODOMETRY), ("/chatter", STRING)], &all, with_definitions);
            let (found, faults, ending) = positions(&file);
            assert_eq!((found.len(), faults.len(), ending), (9, 0, Ending::Complete));
            assert_eq!(found[8], 8.0);
            // the folder of a recording, and no new file in it
            assert_eq!(positions(folder.path()).0, found);
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        }
    }

    #[test]
    fn an_assumed_definition_has_to_fit_the_whole_message() {
        let file = tempfile::NamedTempFile::with_suffix(".db3").unwrap();
        let mut longer = odometry_message(0.0, "odom", "base", &pose(0.0));
        longer.extend([0; 8]);
        database(file.path(), &[("/odom", ODOMETRY)], &[("/odom", 0.0, longer)], false);
        let (found, faults, _) = positions(file.path());
        assert!(found.is_empty() && faults[0].contains("8 bytes more"), "{faults:?}");
    }

    #[test]
    fn a_damaged_file_is_read_up_to_the_fault() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.db3");
        let sent: Vec<_> = (0..400_u32)
            .map(|i| ("/odom", f64::from(i), odometry_message(f64::from(i), "odom", "base", &pose(i.into()))))
            .collect();
        database(&file, &[("/odom", ODOMETRY)], &sent, true);
        let whole = std::fs::read(&file).unwrap();
        let cut = folder.path().join("cut.db3");
        let mut faults = 0;
        for part in 1..20 {
            std::fs::write(&cut, &whole[..whole.len() * part / 20]).unwrap();
            match read(&cut, |_| ()) {
                Ok(Ending::Complete) => panic!("{part} of 20 parts are no whole recording"),
                Ok(Ending::Fault(fault)) => {
                    assert!(fault.contains("after"), "{fault}");
                    faults += 1;
                }
                Err(error) => assert!(error.to_string().contains("cut.db3"), "{error}"),
            }
        }
        assert!(faults > 5, "{faults}");
        for place in (0..whole.len()).step_by(4999) {
            let mut damaged = whole.clone();
            damaged[place] ^= 0x55;
            std::fs::write(&cut, &damaged).unwrap();
            // no panic
            _ = read(&cut, |message| drop(message.decode::<serde_json::Value>()));
        }
    }

    #[test]
    fn messages_outside_of_the_file_and_other_databases_are_reported() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.db3");
        database(&file, &[("/chatter", STRING)], &[("/chatter", 0.0, string_message("hello"))], true);
        std::fs::write(folder.path().join("a.db3-wal"), "more").unwrap();
        let Ending::Fault(fault) = read(&file, |_| ()).unwrap() else { panic!("complete") };
        assert!(fault.contains("a.db3-wal") && fault.contains("after 1 messages"), "{fault}");
        let other = folder.path().join("other.db3");
        Connection::open(&other).unwrap().execute_batch("CREATE TABLE cups (id INTEGER)").unwrap();
        let error = read(&other, |_| ()).unwrap_err().to_string();
        assert!(error.contains("without the tables `topics`"), "{error}");
    }
}
