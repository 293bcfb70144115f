#include "model_format/model_file.hpp"

#include <algorithm>
#include <array>
#include <locale>
#include <sstream>

namespace vnreg::model_format {
namespace {

constexpr std::array<std::string_view, std::variant_size_v<Value>> type_names{"u64", "f64", "bool",
                                                                              "string"};

std::string field_of(std::string_view key) { return "metadata \"" + std::string(key) + "\""; }

[[noreturn]] void refuse(std::string_view key, std::string expected, std::string got) {
  throw Error(ErrorCode::wrong_architecture, field_of(key), std::move(expected), std::move(got));
}

template <typename T>
const T& typed(const ModelFile::Metadata& metadata, std::string_view key) {
  const std::string_view wanted = type_names[Value(T{}).index()];
  const auto found = metadata.find(key);
  if (found == metadata.end()) refuse(key, "a " + std::string(wanted), "nothing");
  const T* value = std::get_if<T>(&found->second);
  if (value == nullptr) {
    refuse(key, "a " + std::string(wanted), "a " + std::string(type_names[found->second.index()]));
  }
  return *value;
}

template <typename Number>
std::string text_of(Number value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(17);
  text << value;
  return text.str();
}

// Written so that a NaN bound or value is refused.
template <typename Number>
Number in_range(std::string_view key, Number value, Number min, Number max) {
  if (!(value >= min && value <= max)) {
    refuse(key, text_of(min) + " to " + text_of(max), text_of(value));
  }
  return value;
}

std::string text_of_shape(std::span<const std::size_t> shape) {
  std::string text = "(";
  for (const std::size_t extent : shape) {
    if (text.size() > 1) text += ", ";
    text += std::to_string(extent);
  }
  return text + ")";
}

}  // namespace

bool ModelFile::has(std::string_view key) const { return metadata_.contains(key); }

std::uint64_t ModelFile::get_u64(std::string_view key, std::uint64_t min, std::uint64_t max) const {
  return in_range(key, typed<std::uint64_t>(metadata_, key), min, max);
}

double ModelFile::get_f64(std::string_view key, double min, double max) const {
  return in_range(key, typed<double>(metadata_, key), min, max);
}

bool ModelFile::get_bool(std::string_view key) const { return typed<bool>(metadata_, key); }

std::string ModelFile::get_string(std::string_view key) const {
  return typed<std::string>(metadata_, key);
}

std::span<const float> ModelFile::tensor_f32(std::string_view name,
                                             std::initializer_list<std::size_t> shape) const {
  const std::string field = "tensor \"" + std::string(name) + "\"";
  const std::string wanted = text_of_shape({shape.begin(), shape.size()});
  const auto found = tensors_.find(name);
  if (found == tensors_.end()) {
    throw Error(ErrorCode::missing_tensor, field, "f32 of shape " + wanted, "nothing");
  }
  const Tensor& tensor = found->second;
  if (!std::equal(tensor.shape.begin(), tensor.shape.end(), shape.begin(), shape.end())) {
    throw Error(ErrorCode::missing_tensor, field + " shape", wanted, text_of_shape(tensor.shape));
  }
  return tensor.f32();
}

}  // namespace vnreg::model_format
