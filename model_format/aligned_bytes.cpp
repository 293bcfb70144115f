#include <new>

#include "model_format/model_file.hpp"

namespace vnreg::model_format {

AlignedBytes::AlignedBytes(std::size_t size)
    : data_(static_cast<std::byte*>(::operator new (size, std::align_val_t{alignment})),
            Release{size}) {}

void AlignedBytes::Release::operator()(std::byte* data) const noexcept {
  ::operator delete (data, std::align_val_t{alignment});
}

std::span<std::byte> AlignedBytes::span() noexcept {
  return {data_.get(), data_ ? data_.get_deleter().size : 0};
}

std::span<const std::byte> AlignedBytes::span() const noexcept {
  return {data_.get(), data_ ? data_.get_deleter().size : 0};
}

}  // namespace vnreg::model_format
