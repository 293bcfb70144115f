// Where a user's first calls arrive. It is not known here whether the processor has the
// instructions of this build, so this file is compiled without them (CMakeLists.txt); without a
// model, which only these functions make, nothing beyond them can be called.
#include <algorithm>
#include <memory>

#include "engine/builtin_model.hpp"
#include "engine/cpu.hpp"
#include "engine/read_model_data.hpp"
#include "model_format/model_file.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg {

using model_format::AlignedBytes;
using model_format::ModelFile;

Model Model::load(const std::string& path) {
  detail::require_cpu();
  const AlignedBytes bytes = model_format::read_file(path);
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
                "a library that was built without models/vnreg.vnr");
  }
  return from_bytes(bytes);
}

Result align(CloudRef source, CloudRef target, const Options& options) {
  static const Model model = Model::builtin();
  return Registrar{model, options}.align(source, target);
}

std::vector<Result> align_many(std::span<const CloudPair> pairs, const Options& options) {
  static const Model model = Model::builtin();
  std::vector<Result> results(pairs.size());
  if (!pairs.empty()) BatchRegistrar(model, options).align_many(pairs, results);
  return results;
}

}  // namespace vnreg
