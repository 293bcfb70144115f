// Model: loading and the facts that the public API tells.
#include "engine/builtin_model.hpp"
#include "engine/cpu.hpp"
#include "engine/model_data.hpp"
#include "model_format/model_file.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg {

using model_format::AlignedBytes;
using model_format::FileBytes;
using model_format::ModelFile;

Model Model::load(const std::string& path) {
  detail::require_cpu();
  const FileBytes bytes = FileBytes::open(path);
  return Model(detail::read_model_data(ModelFile::parse(bytes.span())));
}

Model Model::from_bytes(std::span<const std::byte> bytes) {
  detail::require_cpu();
  AlignedBytes copy(bytes.size());
  std::copy(bytes.begin(), bytes.end(), copy.span().begin());
  return Model(detail::read_model_data(ModelFile::parse(copy.span())));
}

Model Model::builtin() {
  const std::span<const std::byte> bytes = detail::builtin_model_bytes();
  if (bytes.empty()) {
    throw Error(ErrorCode::file_unreadable, "built-in model", "weights compiled into the library",
                "a library that was built without models/small.vnr");
  }
  return from_bytes(bytes);
}

std::string_view Model::name() const noexcept { return data_->arch.name; }
int Model::points() const noexcept { return static_cast<int>(data_->arch.points); }
int Model::min_points() const noexcept { return static_cast<int>(data_->arch.min_points()); }

}  // namespace vnreg
