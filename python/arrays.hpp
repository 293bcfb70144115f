// Point arrays from Python without a copy, and arrays for Python.
#pragma once

#include <nanobind/nanobind.h>

#include <cstddef>
#include <span>

#include "vnreg/vnreg.hpp"

namespace vnreg::python {

/// The memory of an (N, 3) array for as long as this object lives; construct and destroy it with
/// the GIL held, read it with or without.
class BorrowedPoints {
 public:
  /// float32 and float64 with strides that are not negative are borrowed; other layouts, integers
  /// and other floating types are converted to a float64 copy. Clouds and meshes of Open3D and
  /// trimesh: what vnreg._clouds.points_of() takes from them.
  /// Throws ValueError (shape) or TypeError (not numbers), naming the argument.
  BorrowedPoints(nanobind::handle points, const char* argument);
  ~BorrowedPoints();
  BorrowedPoints(const BorrowedPoints&) = delete;
  BorrowedPoints& operator=(const BorrowedPoints&) = delete;

  PointsView view() const noexcept;

 private:
  bool borrow(nanobind::handle points);

  Py_buffer buffer_{};
};

/// A new numpy array, float64.
nanobind::object float_array(std::span<const double> values, std::span<const std::size_t> shape);
/// A new numpy array, int64, of values that are whole numbers.
nanobind::object index_array(std::span<const double> values, std::span<const std::size_t> shape);

}  // namespace vnreg::python
