#include "model_format/model_file.hpp"

namespace vnreg::model_format {
namespace {

// The parser has checked that the bytes start at a multiple of 64 and hold whole elements.
template <typename Scalar>
std::span<const Scalar> elements(const Tensor& tensor, DType wanted) {
  if (tensor.dtype != wanted) {
    throw Error(ErrorCode::missing_tensor, "tensor \"" + tensor.name + "\" dtype",
                std::string(to_string(wanted)), std::string(to_string(tensor.dtype)));
  }
  return {reinterpret_cast<const Scalar*>(tensor.bytes.data()),
          tensor.bytes.size() / sizeof(Scalar)};
}

}  // namespace

std::string_view to_string(DType dtype) noexcept {
  switch (dtype) {
    case DType::f32:
      return "f32";
    case DType::f64:
      return "f64";
    case DType::i32:
      return "i32";
  }
  return "unknown";
}

std::size_t Tensor::element_count() const noexcept {
  std::size_t count = 1;
  for (const std::size_t extent : shape) count *= extent;
  return count;
}

std::span<const float> Tensor::f32() const { return elements<float>(*this, DType::f32); }

std::span<const double> Tensor::f64() const { return elements<double>(*this, DType::f64); }

std::span<const std::int32_t> Tensor::i32() const {
  return elements<std::int32_t>(*this, DType::i32);
}

}  // namespace vnreg::model_format
