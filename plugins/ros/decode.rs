//! Decoding of messages by the definition of their type in the recording.
use re_cdr::{BigEndian, CdrEndian, CdrReader, LittleEndian};
use re_ros_msg::MessageSchema;
use re_ros_msg::message_spec::{
    ArraySize, BuiltInType, ComplexType, MessageSpecification, Type, message_package,
};
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::io::Read;

/// Encoding of messages and of definitions.
const ENCODINGS: [&str; 2] = ["cdr", "ros2msg"];
/// First bytes of data compressed by zstd.
pub(crate) const ZSTD: &[u8] = b"\x28\xb5\x2f\xfd";
/// Bytes before the content: the byte order, and options.
const HEADER_BYTES: usize = 4;
/// Messages are padded to a multiple of this.
const ALIGNMENT_BYTES: usize = 4;
/// Length of the longest message that is decompressed. Unit: bytes.
const MAX_MESSAGE_BYTES: u64 = 1 << 30;
/// Largest depth of messages within messages.
const MAX_DEPTH: usize = 32;
/// Longest list of bytes that is decoded. Longer ones are images and point clouds.
const MAX_BYTES: usize = 1024;

/// Error that prevents decoding a message.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The channel has no definition of its type.
    #[error("the recording has no definition of its type")]
    NoDefinition,
    /// Messages or their definition have an unsupported encoding.
    #[error(
        "expected messages in `cdr` with a definition in `ros2msg`, as ROS 2 records them, got `{message}` and `{definition}`"
    )]
    Encoding {
        /// Encoding of the messages.
        message: String,
        /// Encoding of the definition.
        definition: String,
    },
    /// The definition cannot be parsed.
    #[error("the definition of its type cannot be read: {0}")]
    Definition(String),
    /// The content does not match the definition.
    #[error("the content does not match the definition of its type: {0}")]
    Content(String),
}

/// Definition of a message type.
#[derive(Debug)]
pub(crate) struct Definition {
    main: MessageSpecification,
    /// Types that it contains, by `package/Name`.
    others: HashMap<String, MessageSpecification>,
    /// True if the recording has no definition, so that the content has to show that this one is right.
    is_assumed: bool,
}

impl Definition {
    pub(crate) fn new(
        name: &str,
        encoding: &str,
        text: &[u8],
        message_encoding: &str,
    ) -> Result<Self, DecodeError> {
        if [message_encoding, encoding] != ENCODINGS {
            return Err(DecodeError::Encoding {
                message: message_encoding.into(),
                definition: encoding.into(),
            });
        }
        let wrong = |error: &dyn std::fmt::Display| DecodeError::Definition(error.to_string());
        let text = std::str::from_utf8(text).map_err(|error| wrong(&error))?;
        let MessageSchema { spec, dependencies } =
            MessageSchema::parse(name, text).map_err(|error| wrong(&format!("{error:#}")))?;
        let others = dependencies.into_iter().map(|spec| (short_name(&spec.name), spec)).collect();
        Ok(Self { main: spec, others, is_assumed: false })
    }

    /// Marks the definition as not recorded.
    pub(crate) fn assumed(self) -> Self {
        Self { is_assumed: true, ..self }
    }

    /// Decodes a message.
    pub(crate) fn decode(&self, data: &[u8]) -> Result<Value, DecodeError> {
        if data.starts_with(ZSTD) {
            let mut plain = vec![];
            let read = zstd::Decoder::new(data)
                .and_then(|from| from.take(MAX_MESSAGE_BYTES).read_to_end(&mut plain));
            return match read {
                Ok(_) if !plain.starts_with(ZSTD) => self.decode(&plain),
                Ok(_) => Err(DecodeError::Content("it is compressed twice".into())),
                Err(error) => Err(DecodeError::Content(format!("it cannot be decompressed: {error}"))),
            };
        }
        let Some((header, content)) = data.split_at_checked(HEADER_BYTES) else {
            return Err(DecodeError::Content("it is shorter than its header".into()));
        };
        let decoded = match header[1] {
            0 => self.whole_message(&mut CdrReader::<BigEndian>::new(content)),
            1 => self.whole_message(&mut CdrReader::<LittleEndian>::new(content)),
            other => {
                Err(re_cdr::Error::Custom(format!("unknown representation {other}, expected plain CDR")))
            }
        };
        decoded.map_err(|error| DecodeError::Content(error.to_string()))
    }

    fn whole_message<B: CdrEndian>(&self, reader: &mut CdrReader<'_, B>) -> re_cdr::Result<Value> {
        let message = self.message(reader, &self.main, 0)?;
        if self.is_assumed && reader.remaining() >= ALIGNMENT_BYTES {
            return Err(re_cdr::Error::Custom(format!(
                "the recording has no definition, and the usual one leaves {} bytes more; convert the recording to MCAP on the \
                 robot, with `ros2 bag convert`",
                reader.remaining()
            )));
        }
        Ok(message)
    }

    fn message<B: CdrEndian>(
        &self,
        reader: &mut CdrReader<'_, B>,
        message: &MessageSpecification,
        depth: usize,
    ) -> re_cdr::Result<Value> {
        if depth > MAX_DEPTH {
            return Err(re_cdr::Error::Custom(format!(
                "messages within messages, more than {MAX_DEPTH} deep"
            )));
        }
        let field = |field: &re_ros_msg::message_spec::Field| {
            Ok((field.name.clone(), self.value(reader, message, &field.ty, depth)?))
        };
        message.fields.iter().map(field).collect::<re_cdr::Result<Map<_, _>>>().map(Value::Object)
    }

    fn value<B: CdrEndian>(
        &self,
        reader: &mut CdrReader<'_, B>,
        scope: &MessageSpecification,
        of: &Type,
        depth: usize,
    ) -> re_cdr::Result<Value> {
        let (element, size) = match of {
            Type::BuiltIn(scalar) => return self::scalar(reader, scalar),
            Type::Complex(complex) => {
                let message = self.find(scope, complex)?;
                let own = message.underlying_type_if_enum_like();
                return match own.map_err(|error| re_cdr::Error::Custom(error.to_string()))? {
                    Some(scalar) => self::scalar(reader, scalar),
                    None => self.message(reader, message, depth + 1),
                };
            }
            Type::Array { ty, size } => (&**ty, size),
        };
        let length = match size {
            ArraySize::Fixed(length) => *length,
            ArraySize::Bounded(_) | ArraySize::Unbounded => reader.read_sequence_length()?,
        };
        // each element has a byte or more, so that a damaged length cannot ask for all memory
        if length > reader.remaining() {
            return Err(re_cdr::Error::Custom(format!(
                "a list of {length} elements in {} remaining bytes",
                reader.remaining()
            )));
        }
        let is_bytes =
            matches!(element, Type::BuiltIn(BuiltInType::UInt8 | BuiltInType::Byte | BuiltInType::Char));
        if is_bytes && length > MAX_BYTES {
            reader.read_bytes(length)?;
            return Ok(Value::Null);
        }
        (0..length).map(|_| self.value(reader, scope, element, depth)).collect()
    }

    fn find(&self, scope: &MessageSpecification, of: &ComplexType) -> re_cdr::Result<&MessageSpecification> {
        let name = match of {
            ComplexType::Absolute { package, name } => short_name(&format!("{package}/{name}")),
            ComplexType::Relative { name } => {
                format!("{}/{name}", message_package(&scope.name).unwrap_or_default())
            }
        };
        let missing = || re_cdr::Error::Custom(format!("the type `{name}` is not defined"));
        self.others.get(&name).ok_or_else(missing)
    }
}

/// Returns `package/Name` of `package/Name` or `package/msg/Name`.
fn short_name(name: &str) -> String {
    name.replace("/msg/", "/")
}

fn scalar<B: CdrEndian>(reader: &mut CdrReader<'_, B>, of: &BuiltInType) -> re_cdr::Result<Value> {
    Ok(match of {
        BuiltInType::Bool => reader.read_bool()?.into(),
        BuiltInType::Byte | BuiltInType::Char | BuiltInType::UInt8 => reader.read_u8()?.into(),
        BuiltInType::Int8 => reader.read_i8()?.into(),
        BuiltInType::Int16 => reader.read_i16()?.into(),
        BuiltInType::UInt16 => reader.read_u16()?.into(),
        BuiltInType::Int32 => reader.read_i32()?.into(),
        BuiltInType::UInt32 => reader.read_u32()?.into(),
        BuiltInType::Int64 => reader.read_i64()?.into(),
        BuiltInType::UInt64 => reader.read_u64()?.into(),
        BuiltInType::Float32 => reader.read_f32()?.into(),
        BuiltInType::Float64 => reader.read_f64()?.into(),
        BuiltInType::String(_) => reader.read_string()?.into(),
        BuiltInType::WString(_) => {
            return Err(re_cdr::Error::Custom(
                "strings of wide characters (`wstring`) are not supported".into(),
            ));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Cdr, STRING};

    fn definition(text: &str) -> Definition {
        Definition::new("test_msgs/msg/Test", "ros2msg", text.as_bytes(), "cdr").unwrap()
    }

    #[test]
    fn nested_types_lists_and_both_byte_orders_are_decoded() {
        let text = "uint8 KIND=3\nuint8 flag\nPart[] parts\nfloat64[2] pair\nstring name\n\
                    ===\nMSG: test_msgs/Part\nfloat32 x\nint64 n";
        let data =
            Cdr::new().u8(7).u32(2).f32(0.5).i64(-3).f32(1.5).i64(4).f64(2.0).f64(f64::NAN).string("abc");
        let value = definition(text).decode(&data.bytes()).unwrap();
        let expected = serde_json::json!({
            "flag": 7, "parts": [{"x": 0.5, "n": -3}, {"x": 1.5, "n": 4}], "pair": [2.0, null], "name": "abc"
        });
        assert_eq!(value, expected);
        let big = [[0, 0, 0, 0], 7_u32.to_be_bytes()].concat();
        assert_eq!(definition("uint32 n").decode(&big).unwrap()["n"], 7);
    }

    #[test]
    fn a_damaged_message_is_refused() {
        let faults = [
            ("float64[] x", Cdr::new().u32(u32::MAX).bytes(), "sequence length 4294967295"),
            ("float64[] x", Cdr::new().u32(99).bytes(), "a list of 99 elements in 0 remaining bytes"),
            ("Test x\n===\nMSG: test_msgs/Test\nTest x", Cdr::new().u8(1).bytes(), "more than 32 deep"),
            ("Other x", Cdr::new().u8(1).bytes(), "`test_msgs/Other` is not defined"),
            ("float64 x", Cdr::new().u8(1).bytes(), ""),
            ("float64 x", vec![0, 1], "shorter than its header"),
            ("float64 x", vec![0, 7, 0, 0], "unknown representation 7"),
            ("wstring x", Cdr::new().u8(1).bytes(), "wstring"),
        ];
        for (text, data, words) in faults {
            let error = definition(text).decode(&data).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        let compressed = zstd::encode_all(&Cdr::new().f64(2.5).bytes()[..], 0).unwrap();
        assert_eq!(definition("float64 x").decode(&compressed).unwrap()["x"], 2.5);
        let error = definition("float64 x").decode(&compressed[..9]).unwrap_err().to_string();
        assert!(error.contains("cannot be decompressed"), "{error}");
        let wrong =
            Definition::new("a/B", "protobuf", STRING.1.as_bytes(), "protobuf").unwrap_err().to_string();
        assert!(wrong.contains("got `protobuf` and `protobuf`"), "{wrong}");
    }
}
