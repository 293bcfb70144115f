// What a batch was run with, kept beside its results: rows of two runs with other settings must
// not meet in one file.
#pragma once

#include <string>

#include "engine_options.hpp"

namespace vnreg::cli {

/// The settings that the rows depend on, as one JSON object and a line end.
std::string run_record(const EngineArguments& arguments, const Model& model);

/// Where the record of the results at `path` lies.
std::string record_path(const std::string& path);

/// Writes the record, all or nothing. Throws CommandError.
void write_record(const std::string& path, const std::string& record);

/// Throws CommandError (usage) unless the record at `path` says what `record` says.
void check_record(const std::string& path, const std::string& record);

}  // namespace vnreg::cli
