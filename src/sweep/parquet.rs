//! A table as a Parquet file: one row group, Snappy, optional columns, units and types in its metadata.

use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

use super::table::{ColumnValues, Table, TableColumn};

/// The whole file. Equal tables give equal bytes.
pub(super) fn bytes(table: &Table) -> Result<Vec<u8>, ParquetError> {
    let fields: Result<Vec<_>, ParquetError> = table.columns.iter().map(|column| field(column).map(Arc::new)).collect();
    let schema = Type::group_type_builder("sensel").with_fields(fields?).build()?;
    let metadata = table.metadata.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone())).collect();
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(concat!("sensel ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(metadata))
        .build();
    let mut file = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for column in &table.columns {
        match &column.values {
            ColumnValues::Text(all) => {
                let bytes: Vec<Option<ByteArray>> = all
                    .iter()
                    .map(|value| value.as_ref().map(|text| ByteArray::from(text.as_bytes().to_vec())))
                    .collect();
                write::<ByteArrayType>(&mut group, &bytes)?;
            }
            ColumnValues::Whole(all) => write::<Int64Type>(&mut group, all)?,
            ColumnValues::Number(all) => write::<DoubleType>(&mut group, all)?,
            ColumnValues::Flag(all) => write::<BoolType>(&mut group, all)?,
        }
    }
    group.close()?;
    file.into_inner()
}

fn field(column: &TableColumn) -> Result<Type, ParquetError> {
    let (physical, logical) = match column.values {
        ColumnValues::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        ColumnValues::Whole(_) => (Physical::INT64, None),
        ColumnValues::Number(_) => (Physical::DOUBLE, None),
        ColumnValues::Flag(_) => (Physical::BOOLEAN, None),
    };
    let builder = Type::primitive_type_builder(&column.name, physical).with_repetition(Repetition::OPTIONAL);
    builder.with_logical_type(logical).build()
}

fn write<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    values: &[Option<T::T>],
) -> Result<(), ParquetError> {
    let present: Vec<T::T> = values.iter().flatten().cloned().collect();
    let levels: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
    let mut writer = group.next_column()?.ok_or_else(|| ParquetError::General("a column too many".to_owned()))?;
    writer.typed::<T>().write_batch(&present, Some(&levels), None)?;
    writer.close()
}
