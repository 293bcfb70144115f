// The parts of a model file after the header. Each function throws Error (corrupt_model).
#pragma once

#include "model_format/byte_cursor.hpp"
#include "model_format/header.hpp"
#include "model_format/model_file.hpp"

namespace vnreg::model_format {

/// A metadata key or tensor name: 1 to 128 of A-Z a-z 0-9 . _, after `previous` in byte order.
/// `what` names the entry in errors.
std::string_view parse_name(ByteCursor& cursor, const std::string& what, std::string_view previous);

ModelFile::Metadata parse_metadata(std::span<const std::byte> file, const Header& header);

/// The table and the padding after it. The tensors borrow `file`; their elements are not looked at.
ModelFile::Tensors parse_tensor_table(std::span<const std::byte> file, const Header& header);

/// The data checksum, the padding between tensors, and that every float is finite.
void check_data(std::span<const std::byte> file, const Header& header,
                const ModelFile::Tensors& tensors);

/// That bytes `begin` to `end` of the file are zero; `what` names them in errors.
void check_zero(std::span<const std::byte> file, std::size_t begin, std::size_t end,
                const std::string& what);

}  // namespace vnreg::model_format
