// Any bytes as a model file: a model whose tensors lie in the file, or an error.
#include <algorithm>
#include <cstdint>
#include <span>

#include "model_checks.hpp"
#include "model_format/model_file.hpp"

namespace vnreg::fuzz {
namespace {

using model_format::AlignedBytes;
using model_format::DType;
using model_format::ModelFile;
using model_format::Tensor;

void check_tensor(std::span<const std::byte> file, const Tensor& tensor) {
  const std::size_t element = tensor.dtype == DType::f64 ? 8 : 4;
  require(tensor.bytes.size() == tensor.element_count() * element, "a tensor has its elements");
  require(tensor.bytes.data() >= file.data() &&
              tensor.bytes.data() + tensor.bytes.size() <= file.data() + file.size(),
          "a tensor lies in the file");
}

/// Asks for the tensor as each type; the wrong ones must be refused.
void check_elements(const ModelFile& file, const Tensor& tensor) {
  int right = 0;
  const auto ask = [&](auto elements) {
    try {
      right += elements().size() == tensor.element_count() ? 1 : 0;
    } catch (const Error& error) {
      check(error);
    }
  };
  ask([&] { return tensor.f32(); });
  ask([&] { return tensor.f64(); });
  ask([&] { return tensor.i32(); });
  require(right == 1, "a tensor has one type");
  if (tensor.dtype != DType::f32) return;
  for (const float value : tensor.f32()) require(value - value == 0, "weights are finite");
  if (tensor.shape.size() == 1) file.tensor_f32(tensor.name, {tensor.shape[0]});
}

/// Asks for every key as each type and in a range that few values have.
void check_metadata(const ModelFile& file) {
  for (const auto& entry : file.metadata()) {
    const std::string& key = entry.first;
    const auto ask = [](auto get) {
      try {
        get();
      } catch (const Error& error) {
        check(error);
      }
    };
    ask([&] { file.get_u64(key, 4, 512); });
    ask([&] { file.get_f64(key, 0.01, 10); });
    ask([&] { file.get_bool(key); });
    ask([&] { file.get_string(key); });
  }
}

void read(std::span<const std::byte> bytes) {
  AlignedBytes copy(bytes.size());
  std::ranges::copy(bytes, copy.span().begin());
  const std::span<const std::byte> content = std::as_const(copy).span();
  try {
    const ModelFile file = ModelFile::parse(content);
    for (const auto& [name, tensor] : file.tensors()) {
      check_tensor(content, tensor);
      check_elements(file, tensor);
    }
    check_metadata(file);
  } catch (const Error& error) {
    check(error);
  }
}

}  // namespace
}  // namespace vnreg::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  vnreg::fuzz::read(std::as_bytes(std::span(data, size)));
  return 0;
}
