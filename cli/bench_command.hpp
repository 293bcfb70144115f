// `vnreg bench`: how long a pair takes on this machine.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "command.hpp"

namespace vnreg::cli {

struct BenchArguments {
  std::string model;  // empty: the built-in model
  std::vector<int> points{256, 512, 1024, 2048, 4096};
  double seconds = 0.5;
  bool json = false;
  bool quiet = false;
};

/// Declares the command; the parse fills `arguments`.
CLI::App* add_bench_command(CLI::App& app, BenchArguments& arguments);

/// Measures every mode of the model, on one thread and on all. Throws CommandError.
Outcome run_bench(const BenchArguments& arguments);

}  // namespace vnreg::cli
