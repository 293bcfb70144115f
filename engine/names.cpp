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
    case Status::scales_differ:
      return "scales_differ";
  }
  return "unknown";
}

std::string_view to_string(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::file_unreadable:
      return "file_unreadable";
    case ErrorCode::not_a_model:
      return "not_a_model";
    case ErrorCode::unsupported_version:
      return "unsupported_version";
    case ErrorCode::corrupt_model:
      return "corrupt_model";
    case ErrorCode::wrong_architecture:
      return "wrong_architecture";
    case ErrorCode::missing_tensor:
      return "missing_tensor";
    case ErrorCode::invalid_option:
      return "invalid_option";
    case ErrorCode::unsupported_cpu:
      return "unsupported_cpu";
    case ErrorCode::invalid_points:
      return "invalid_points";
  }
  return "unknown";
}

}  // namespace vnreg
