// The words of the public API.
#include "vnreg/vnreg.hpp"

namespace vnreg {

std::string_view version() noexcept { return VNREG_VERSION; }

std::string_view to_string(Mode mode) noexcept {
  switch (mode) {
    case Mode::coarse:
      return "coarse";
    case Mode::paper:
      return "paper";
    case Mode::verified:
      return "verified";
  }
  return "unknown";
}

std::string_view to_string(Status status) noexcept {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::low_confidence:
      return "low_confidence";
    case Status::too_few_points:
      return "too_few_points";
    case Status::not_finite:
      return "not_finite";
    case Status::degenerate:
      return "degenerate";
    case Status::ambiguous:
      return "ambiguous";
    case Status::timed_out:
      return "timed_out";
    case Status::cancelled:
      return "cancelled";
  }
  return "unknown";
}

}  // namespace vnreg
