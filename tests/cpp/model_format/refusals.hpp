// Parses crafted bytes and hands back the refusal, so that a test can look at all of it.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include "file_builder.hpp"
#include "model_format/model_file.hpp"

namespace vnreg::model_format::test {

/// A parsed file with the buffer it borrows; the buffer is exactly as long as the file, so that a
/// read past its end is seen by the address sanitizer.
struct Parsed {
  AlignedBytes buffer;
  ModelFile file;
};

inline Parsed parse(const Bytes& bytes) {
  AlignedBytes buffer(bytes.size());
  std::memcpy(buffer.span().data(), bytes.data(), bytes.size());
  ModelFile file = ModelFile::parse(std::as_const(buffer).span());
  return {std::move(buffer), std::move(file)};
}

inline std::optional<Error> refusal(const Bytes& bytes) {
  try {
    parse(bytes);
  } catch (const Error& error) {
    return error;
  }
  return std::nullopt;
}

/// Checks that `bytes` are refused with this code, about this field.
inline Error check_refused(const Bytes& bytes, ErrorCode code, const std::string& field) {
  const std::optional<Error> error = refusal(bytes);
  REQUIRE(error.has_value());
  INFO(error->what());
  CHECK(error->code() == code);
  CHECK_THAT(error->field(), Catch::Contains(field));
  CHECK_FALSE(error->expected().empty());
  CHECK_FALSE(error->got().empty());
  CHECK(error->expected() != error->got());
  return *error;
}

inline Error check_corrupt(const Bytes& bytes, const std::string& field) {
  return check_refused(bytes, ErrorCode::corrupt_model, field);
}

}  // namespace vnreg::model_format::test
