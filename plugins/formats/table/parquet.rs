//! Apache Parquet, uncompressed, in one row group: texts are required UTF-8, numbers optional doubles.
use super::{DataColumn, DataTable, TableError};
use ::parquet::basic::{LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use ::parquet::errors::ParquetError;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::{Type, TypePtr};
use std::sync::Arc;

/// Returns the table as the bytes of a Parquet file.
///
/// # Errors
/// If columns differ in length or share a name.
pub fn to_parquet(table: &DataTable) -> Result<Vec<u8>, TableError> {
    table.rows()?;
    write(table).map_err(|error| TableError::Writer(error.to_string()))
}

fn write(table: &DataTable) -> Result<Vec<u8>, ParquetError> {
    let fields = table.columns.iter().map(|(name, column)| field(name, column));
    let schema = Type::group_type_builder("table").with_fields(fields.collect::<Result<_, _>>()?).build()?;
    // The version of the library is not part of the data.
    let properties = WriterProperties::builder().set_created_by("manifactor".to_owned()).build();
    let mut bytes = vec![];
    let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for (_, column) in &table.columns {
        let Some(mut writer) = group.next_column()? else { break };
        match column {
            DataColumn::Text(cells) => {
                let cells: Vec<ByteArray> =
                    cells.iter().map(|cell| cell.as_bytes().to_vec().into()).collect();
                writer.typed::<ByteArrayType>().write_batch(&cells, None, None)?;
            }
            DataColumn::Number(cells) => {
                let levels: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
                let present: Vec<f64> = cells.iter().copied().flatten().collect();
                writer.typed::<DoubleType>().write_batch(&present, Some(&levels), None)?;
            }
        }
        writer.close()?;
    }
    group.close()?;
    file.close()?;
    Ok(bytes)
}

fn field(name: &str, column: &DataColumn) -> Result<TypePtr, ParquetError> {
    let builder = match column {
        DataColumn::Text(_) => Type::primitive_type_builder(name, Physical::BYTE_ARRAY)
            .with_logical_type(Some(LogicalType::String))
            .with_repetition(Repetition::REQUIRED),
        DataColumn::Number(_) => {
            Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::OPTIONAL)
        }
    };
    builder.build().map(Arc::new)
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;
    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use ::parquet::record::Field;

    #[test]
    fn what_is_written_is_read_back() {
        let bytes = to_parquet(&sample()).unwrap();
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        let rows: Vec<Vec<Field>> = reader
            .get_row_iter(None)
            .unwrap()
            .map(|row| row.unwrap().get_column_iter().map(|(_, field)| field.clone()).collect())
            .collect();
        assert_eq!(rows[0], [Field::Str("plain".into()), Field::Double(0.1 + 0.2)]);
        assert_eq!(rows[1], [Field::Str("with, comma".into()), Field::Null]);
        assert_eq!(rows[2], [Field::Str("with \"quotes\"".into()), Field::Double(-1e-300)]);
    }
}
