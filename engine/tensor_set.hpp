// Tensors of a model file by name and exact shape; knows afterwards which were never asked for.
#pragma once

#include <set>
#include <span>
#include <string>

#include "kernels/linear.hpp"
#include "model_format/model_file.hpp"

namespace vnreg::detail {

using kernels::Index;

class TensorSet {
 public:
  explicit TensorSet(const model_format::ModelFile& file) : file_(file) {}

  std::span<const float> vector(const std::string& name, Index size);
  std::span<const float> matrix(const std::string& name, Index rows, Index cols);
  kernels::RowMajorMatrix dense(const std::string& name, Index rows, Index cols);
  kernels::PackedMatrix packed(const std::string& name, Index rows, Index cols);
  /// `name`.weight (out, in) and `name`.bias (out).
  kernels::Linear linear(const std::string& name, Index out, Index in);

  /// Throws Error (wrong_architecture) if the file holds a tensor that nobody asked for.
  void refuse_others(const std::string& architecture) const;

 private:
  const model_format::ModelFile& file_;
  std::set<std::string> taken_;
};

}  // namespace vnreg::detail
