#include "engine/tensor_set.hpp"

namespace vnreg::detail {

using kernels::RowMajorMatrix;

std::span<const float> TensorSet::vector(const std::string& name, Index size) {
  taken_.insert(name);
  return file_.tensor_f32(name, {static_cast<std::size_t>(size)});
}

std::span<const float> TensorSet::matrix(const std::string& name, Index rows, Index cols) {
  taken_.insert(name);
  return file_.tensor_f32(name, {static_cast<std::size_t>(rows), static_cast<std::size_t>(cols)});
}

RowMajorMatrix TensorSet::dense(const std::string& name, Index rows, Index cols) {
  return Eigen::Map<const RowMajorMatrix>(matrix(name, rows, cols).data(), rows, cols);
}

kernels::PackedMatrix TensorSet::packed(const std::string& name, Index rows, Index cols) {
  return kernels::PackedMatrix(dense(name, rows, cols));
}

kernels::Linear TensorSet::linear(const std::string& name, Index out, Index in) {
  return {dense(name + ".weight", out, in), vector(name + ".bias", out)};
}

void TensorSet::refuse_others(const std::string& architecture) const {
  for (const auto& [name, tensor] : file_.tensors()) {
    if (!taken_.contains(name)) {
      throw Error(ErrorCode::wrong_architecture, "tensor \"" + name + "\"",
                  "only the tensors of architecture " + architecture, "one more");
    }
  }
}

}  // namespace vnreg::detail
