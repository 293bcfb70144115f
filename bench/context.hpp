// What every report of a benchmark program says of its build and its machine.
#pragma once

#include <benchmark/benchmark.h>

#include <fstream>
#include <string>

#include "vnreg/vnreg.hpp"

namespace vnreg::bench {

/// The processor's name as the system tells it; empty where it does not.
inline std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return {};
}

inline void add_context() {
  benchmark::AddCustomContext("processor", processor_name());
  benchmark::AddCustomContext("vnreg", std::string(version()));
  benchmark::AddCustomContext("instruction set", std::string(instruction_set()));
  benchmark::AddCustomContext("compiler", VNREG_COMPILER ", " VNREG_BUILD_TYPE);
}

}  // namespace vnreg::bench
