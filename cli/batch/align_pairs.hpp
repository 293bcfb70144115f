// Aligns the pairs of a table, several at a time, and hands their rows on in the table's order.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>

#include "batch/pair_table.hpp"
#include "batch/result_row.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::cli {

struct PairsToAlign {
  const PairTable& table;
  std::size_t first;  // the rows before it are done
  const Model& model;
  Options options;  // of one pair; its threads are not used
  int threads;      // pairs at a time; 0: one for each processor
};

/// Calls sink(row) for every row from `first` on, in order, one call at a time, from any thread.
/// What is wrong with a pair goes into its row. When `stop` becomes true, the pairs that were begun
/// are finished. Throws what the sink or a registrar's making throws.
void align_pairs(const PairsToAlign& work, const std::function<void(const ResultRow&)>& sink,
                 const std::atomic<bool>& stop);

}  // namespace vnreg::cli
