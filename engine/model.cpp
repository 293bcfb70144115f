// What a model tells about itself.
#include "engine/model_data.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg {

std::string_view Model::name() const noexcept { return data_->arch.name; }
int Model::points() const noexcept { return static_cast<int>(data_->arch.points); }
int Model::min_points() const noexcept { return static_cast<int>(data_->arch.min_points()); }

}  // namespace vnreg
