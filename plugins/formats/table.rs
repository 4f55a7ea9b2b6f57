//! Tables of texts and numbers: CSV for people and spreadsheets, [Parquet](to_parquet) for data frames.
mod parquet;

pub use parquet::to_parquet;

/// A table, column by column.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DataTable {
    /// Names and cells; all columns have equal length.
    pub columns: Vec<(String, DataColumn)>,
}

/// The cells of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum DataColumn {
    /// Text cells.
    Text(Vec<String>),
    /// Numeric cells; `None` for a missing number.
    Number(Vec<Option<f64>>),
}

/// The reason why a table could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The columns have different lengths.
    #[error("column `{column}` has {found} cells where the first has {expected}")]
    Ragged {
        /// Name of the column that differs.
        column: String,
        /// Number of cells in the first column.
        expected: usize,
        /// Number of cells in this column.
        found: usize,
    },
    /// The writer failed.
    #[error("the table cannot be written: {0}")]
    Writer(String),
}

impl DataColumn {
    /// Returns the number of cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Text(cells) => cells.len(),
            Self::Number(cells) => cells.len(),
        }
    }

    /// Returns whether there are no cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Formats a cell for CSV; numbers read back bit for bit.
    fn cell(&self, row: usize) -> String {
        match self {
            Self::Text(cells) => cells.get(row).map(|text| no_formula(text)).unwrap_or_default(),
            Self::Number(cells) => cells.get(row).copied().flatten().map_or(String::new(), |x| x.to_string()),
        }
    }
}

impl DataTable {
    /// Returns the number of rows.
    ///
    /// # Errors
    /// If columns differ in length.
    pub fn rows(&self) -> Result<usize, TableError> {
        let expected = self.columns.first().map_or(0, |(_, column)| column.len());
        match self.columns.iter().find(|(_, column)| column.len() != expected) {
            Some((name, column)) => {
                Err(TableError::Ragged { column: name.clone(), expected, found: column.len() })
            }
            None => Ok(expected),
        }
    }

    /// Formats the table as CSV with a header. Missing numbers are empty cells. A text that a spreadsheet
    /// would interpret as a formula gets an apostrophe as prefix: one that begins with `=`, `+`, `-`, `@`, a
    /// tab or a line break and is not a number.
    ///
    /// # Errors
    /// If columns differ in length.
    pub fn to_csv(&self) -> Result<String, TableError> {
        let fail = |error: &dyn std::fmt::Display| TableError::Writer(error.to_string());
        let rows = self.rows()?;
        let mut writer = csv::Writer::from_writer(vec![]);
        writer.write_record(self.columns.iter().map(|(name, _)| no_formula(name))).map_err(|e| fail(&e))?;
        for row in 0..rows {
            let cells = self.columns.iter().map(|(_, column)| column.cell(row));
            writer.write_record(cells).map_err(|e| fail(&e))?;
        }
        let bytes = writer.into_inner().map_err(|e| fail(&e))?;
        String::from_utf8(bytes).map_err(|e| fail(&e))
    }
}

/// Makes a text safe for spreadsheets: a class or variant name from outside may be a formula that fetches or
/// sends data.
fn no_formula(text: &str) -> String {
    let begins_one = text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n']);
    if begins_one && text.parse::<f64>().is_err() { format!("'{text}") } else { text.to_owned() }
}

#[cfg(test)]
pub(crate) fn sample() -> DataTable {
    let text = ["plain", "with, comma", "with \"quotes\""].map(str::to_owned).to_vec();
    let numbers = vec![Some(0.1 + 0.2), None, Some(-1e-300)];
    DataTable {
        columns: vec![("name".into(), DataColumn::Text(text)), ("x".into(), DataColumn::Number(numbers))],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_reads_back_as_the_same_bits() {
        let text = sample().to_csv().unwrap();
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let rows: Vec<(String, Option<f64>)> = reader.deserialize().map(Result::unwrap).collect();
        let DataColumn::Number(numbers) = &sample().columns[1].1 else {
            panic!("the second column is of numbers")
        };
        assert_eq!(rows.iter().map(|row| row.1).collect::<Vec<_>>(), *numbers);
        assert_eq!(rows[2].0, "with \"quotes\"");
    }

    #[test]
    fn texts_are_no_formulas() {
        let texts = ["=1+1", "+cmd", "-2+3", "@sum", "\t=1", "-0.5", "+1e3", "a=b", ""].map(str::to_owned);
        let columns = vec![("=x".to_owned(), DataColumn::Text(texts.into()))];
        let text = DataTable { columns }.to_csv().unwrap();
        let rows: Vec<String> = csv::ReaderBuilder::new()
            .has_headers(false)
            .from_reader(text.as_bytes())
            .deserialize()
            .map(|row| row.map(|(cell,): (String,)| cell).unwrap())
            .collect();
        let safe = ["'=x", "'=1+1", "'+cmd", "'-2+3", "'@sum", "'\t=1", "-0.5", "+1e3", "a=b", ""];
        assert_eq!(rows, safe);
    }

    #[test]
    fn ragged_columns_are_refused() {
        let mut table = sample();
        table.columns[1].1 = DataColumn::Number(vec![]);
        assert!(matches!(table.to_csv(), Err(TableError::Ragged { expected: 3, found: 0, .. })));
        assert!(matches!(to_parquet(&table), Err(TableError::Ragged { .. })));
    }
}
