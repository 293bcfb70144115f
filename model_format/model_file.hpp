// Reader of the `.vnr` container: metadata and tensors, checked byte by byte (see SPEC.md).
// It knows nothing of networks; what an architecture needs is checked by the engine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "vnreg/error.hpp"

namespace vnreg::model_format {

enum class DType : std::uint32_t { f32 = 1, f64 = 2, i32 = 3 };

std::string_view to_string(DType dtype) noexcept;

struct Tensor {
  std::string name;
  DType dtype = DType::f32;
  std::vector<std::size_t> shape;    // row-major, rank 1 to 4
  std::span<const std::byte> bytes;  // borrowed from the buffer that was parsed

  std::size_t element_count() const noexcept;
  /// The elements; throws Error (missing_tensor) when the dtype is another one.
  std::span<const float> f32() const;
  std::span<const double> f64() const;
  std::span<const std::int32_t> i32() const;
};

using Value = std::variant<std::uint64_t, double, bool, std::string>;

/// A parsed file. Borrows the bytes it was parsed from: they must outlive it, unchanged.
class ModelFile {
 public:
  using Metadata = std::map<std::string, Value, std::less<>>;
  using Tensors = std::map<std::string, Tensor, std::less<>>;

  /// Checks every rule of SPEC.md. Throws Error naming the field, its byte, expected and got:
  /// not_a_model, unsupported_version, corrupt_model; invalid_option when `bytes` does not start
  /// at an address that is a multiple of 64.
  static ModelFile parse(std::span<const std::byte> bytes);

  const Metadata& metadata() const noexcept { return metadata_; }
  const Tensors& tensors() const noexcept { return tensors_; }
  /// The head checksum (SPEC.md, header field 10): it covers everything, so it identifies the file.
  std::uint32_t checksum() const noexcept { return checksum_; }

  /// Whether the metadata has this key.
  bool has(std::string_view key) const;
  /// Typed metadata; throws Error (wrong_architecture) when absent, of another type, or out of the
  /// inclusive range.
  std::uint64_t get_u64(std::string_view key, std::uint64_t min, std::uint64_t max) const;
  double get_f64(std::string_view key, double min, double max) const;
  bool get_bool(std::string_view key) const;
  std::string get_string(std::string_view key) const;

  /// The f32 tensor of this name and exact shape; throws Error (missing_tensor) otherwise.
  std::span<const float> tensor_f32(std::string_view name,
                                    std::initializer_list<std::size_t> shape) const;

 private:
  Metadata metadata_;
  Tensors tensors_;
  std::uint32_t checksum_ = 0;
};

/// A 64-byte aligned buffer that owns a file's bytes; they start out undefined.
/// Empty after it was moved from.
class AlignedBytes {
 public:
  static constexpr std::size_t alignment = 64;

  explicit AlignedBytes(std::size_t size);

  std::span<std::byte> span() noexcept;
  std::span<const std::byte> span() const noexcept;

 private:
  struct Release {
    std::size_t size = 0;
    void operator()(std::byte* data) const noexcept;
  };
  std::unique_ptr<std::byte, Release> data_;
};

/// The bytes of a file. They are copied, never mapped: whoever may write to a mapped file could
/// change it after it was checked, or end the process by making it shorter. Throws Error
/// (file_unreadable): not there, not a regular file, over 1 GiB (refused before anything is
/// allocated), or failing while it is read.
AlignedBytes read_file(const std::string& path);

}  // namespace vnreg::model_format
