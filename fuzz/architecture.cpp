// Any bytes as a model that the engine is to run: keys, ranges, tensors, shapes.
#include <cstdint>
#include <span>

#include "model_checks.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::fuzz {
namespace {

void load(std::span<const std::byte> bytes) {
  try {
    const Model model = Model::from_bytes(bytes);
    require(!model.name().empty() && model.name().size() <= 64, "a model has a name");
    require(model.min_points() >= 24 && model.points() >= model.min_points(), "and sizes");
  } catch (const Error& error) {
    check(error);
  }
}

}  // namespace
}  // namespace vnreg::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  vnreg::fuzz::load(std::as_bytes(std::span(data, size)));
  return 0;
}
