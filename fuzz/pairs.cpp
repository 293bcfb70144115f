// Any bytes as the table of pairs of `vnreg batch`.
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "batch/csv.hpp"
#include "batch/pair_table.hpp"
#include "cloud_file/cloud_file_error.hpp"
#include "messages.hpp"
#include "shown_text.hpp"

namespace vnreg::fuzz {
namespace {

using cli::Pair;

/// "a,b" and a line's end.
constexpr std::size_t least_bytes_of_a_pair = 4;

void check(const Pair& pair) {
  require(!pair.source.empty() && !pair.target.empty(), "a pair has two names");
  for (const std::string* text : {&pair.id, &pair.source, &pair.target}) {
    const std::string shown = cli::shown_text(*text);
    require(cli::shown_text(shown) == shown, "what is shown is shown as it is");
  }
}

/// A line may hold the other line ends, where the first one is a CR alone; a field written cannot.
bool fits_a_line(const Pair& pair) {
  return (pair.id + pair.source + pair.target).find('\n') == std::string::npos;
}

void check_round_trip(const std::vector<Pair>& pairs) {
  std::string table = "id,source,target\n";
  for (const auto& [id, source, target] : pairs) {
    table +=
        cli::csv_field(id) + ',' + cli::csv_field(source) + ',' + cli::csv_field(target) + '\n';
  }
  const std::vector<Pair> again = cli::parse_pairs(table);
  require(std::ranges::equal(again, pairs,
                             [](const Pair& a, const Pair& b) {
                               return a.id == b.id && a.source == b.source && a.target == b.target;
                             }),
          "what is written is read again");
}

void read(std::string_view bytes) {
  try {
    const std::vector<Pair> pairs = cli::parse_pairs(bytes);
    require(least_bytes_of_a_pair * pairs.size() <= bytes.size() + 1, "no more pairs than fit");
    std::ranges::for_each(pairs, check);
    if (std::ranges::all_of(pairs, fits_a_line)) check_round_trip(pairs);
  } catch (const cloud_file::CloudFileError& error) {
    check_message(error.what());
  }
}

}  // namespace
}  // namespace vnreg::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  vnreg::fuzz::read({reinterpret_cast<const char*>(data), size});
  return 0;
}
