// The viewer's page: one HTML file that shows a pair of clouds and what was found (docs/viewer.md).
#pragma once

#include <string>
#include <string_view>

#include "vnreg/vnreg.hpp"

namespace vnreg::viewer {

/// What a page shows. Everything is borrowed.
struct ViewedPair {
  PointsView source, target;
  std::string_view source_name, target_name;  ///< any bytes
  const Result& result;
  const Explanation* explanation = nullptr;  ///< of the same call; null: the result alone is shown
  std::string_view model;                    ///< its name; may be empty
  std::string_view mode;                     ///< likewise
};

/// The pair as JSON without any `<`; the page's script reads it (viewer/src/pair_data.js).
std::string view_data(const ViewedPair& pair);

/// Stands in the template where the data goes.
inline constexpr std::string_view data_placeholder = "{{vnreg:data}}";
/// The page without data, about 0.6 MB.
std::string view_template();
/// The page with the data of a pair.
std::string view_page(std::string_view data);

}  // namespace vnreg::viewer
