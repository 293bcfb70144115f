// From a model file to the weights as the kernels want them.
#pragma once

#include <memory>

#include "model_format/model_file.hpp"

namespace vnreg::detail {

struct ModelData;

/// Throws Error: wrong_architecture (hyper-parameters, tensors that do not belong), missing_tensor.
std::shared_ptr<const ModelData> read_model_data(const model_format::ModelFile& file);

}  // namespace vnreg::detail
