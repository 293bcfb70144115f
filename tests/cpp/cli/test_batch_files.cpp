// The files that `vnreg batch` reads: tables of pairs, and the results of an earlier run.
#include <catch2/catch.hpp>
#include <ctime>
#include <string>
#include <vector>

#include "batch/pair_table.hpp"
#include "batch/result_row.hpp"
#include "batch/results_file.hpp"
#include "batch/row_journal.hpp"
#include "batch/run_record.hpp"
#include "command.hpp"
#include "temporary_folder.hpp"

using namespace vnreg::cli;
using vnreg::test::TemporaryFolder;

namespace {

constexpr RowFormat formats[] = {RowFormat::csv, RowFormat::jsonl};

ResultRow whole_row() {
  ResultRow row;
  row.id = "one, \"two\"";
  row.source = "a.ply";
  row.target = " b.ply ";
  row.status = "ok";
  row.T_target_source = vnreg::Pose{1, 0, 0, -0.0, 0, 1, 0, 1e-300, 0, 0, 1, 1.0 / 3, 0, 0, 0, 1};
  row.confidence = 0.1;
  row.points_source = 1024;
  row.ms = 12.5;
  return row;
}

std::string line_of(const ResultRow& row, RowFormat format) {
  const std::string line = row_line(row, format);
  return line.substr(0, line.size() - 1);
}

std::string replaced(std::string text, std::string_view old, std::string_view other) {
  const std::size_t place = text.find(old);
  REQUIRE(place != std::string::npos);
  return text.replace(place, old.size(), other);
}

/// Of the processor: others that use it make no difference.
double seconds_of(const auto& work) {
  const std::clock_t begin = std::clock();
  work();
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

}  // namespace

TEST_CASE("a row that was written is read again", "[batch]") {
  for (const RowFormat format : formats) {
    for (const ResultRow& row : {whole_row(), ResultRow{}}) {
      const auto again = parse_row(line_of(row, format), format);
      REQUIRE(again);
      CHECK(row_line(*again, format) == row_line(row, format));
    }
  }
}

TEST_CASE("every status of the engine is one of a row", "[batch]") {
  ResultRow row = whole_row();
  for (const std::string status :
       {"ok", "low_confidence", "too_few_points", "not_finite", "degenerate", "ambiguous",
        "timed_out", "cancelled", "scales_differ", "unreadable"}) {
    row.status = status;
    for (const RowFormat format : formats) CHECK(parse_row(line_of(row, format), format));
  }
}

TEST_CASE("a row that no run writes is refused", "[batch]") {
  const std::string json = line_of(whole_row(), RowFormat::jsonl);
  const std::string csv = line_of(whole_row(), RowFormat::csv);
  const auto refuses_json = [&](std::string_view old, std::string_view other) {
    return !parse_row(replaced(json, old, other), RowFormat::jsonl);
  };
  const auto refuses_csv = [&](std::string_view old, std::string_view other) {
    return !parse_row(replaced(csv, old, other), RowFormat::csv);
  };
  // A whole number that no 64 bits hold: the conversion was undefined.
  CHECK(refuses_json("\"row\":0", "\"row\":1e300"));
  CHECK(refuses_json("\"row\":0", "\"row\":0.5"));
  CHECK(refuses_json("1024", "18446744073709551615"));
  // The summary prints the statuses.
  CHECK(refuses_json("\"ok\"", "\"\\u001b[2J\""));
  CHECK(refuses_json("\"ok\"", "\"unknown\""));
  CHECK(refuses_csv(",ok,", ",\x1b[2J,"));
  CHECK(refuses_json("\"error\":null", "\"error\":\"\\u0007\""));
  CHECK(refuses_csv("12.5", "nan"));
  CHECK(refuses_csv("12.5", "12.50"));
  CHECK(refuses_json("\"row\":0", "\"row\":0,\"row\":0"));
  CHECK(refuses_json("{", "{ "));
}

TEST_CASE("a line of very many names takes no square of time", "[batch]") {
  std::string line = "{";
  for (int i = 0; i < 60'000; ++i) line += '"' + std::to_string(i) + "\":0,";
  line += "\"row\":0}";
  CHECK(seconds_of([&] { CHECK_FALSE(parse_row(line, RowFormat::jsonl)); }) < 5);
}

TEST_CASE("a journal of one long line is read in linear time", "[batch]") {
  const TemporaryFolder folder;
  const auto seconds_to_read = [&](std::size_t mebibytes) {
    const std::string path = folder.write("rows.jsonl", "");
    std::filesystem::resize_file(path, mebibytes << 20U);  // zeros, and no line's end
    const RowJournal journal(path);
    return seconds_of([&] { CHECK(journal.for_each_line([](std::string_view) { FAIL(); }) == 0); });
  };
  // 16 times as long took about 100 times as long.
  CHECK(seconds_to_read(256) < 45 * seconds_to_read(16));
}

TEST_CASE("lines that span the pieces of a file are whole", "[batch]") {
  const TemporaryFolder folder;
  std::string bytes;
  for (std::size_t size : {std::size_t{10}, std::size_t{200'000}, std::size_t{0}, std::size_t{7}}) {
    bytes += std::string(size, 'x') + '\n';
  }
  const RowJournal journal(folder.write("rows.jsonl", bytes + "rest"));
  std::vector<std::size_t> sizes;
  const auto add = [&](std::string_view line) { sizes.push_back(line.size()); };
  CHECK(journal.for_each_line(add) == bytes.size());
  CHECK(sizes == std::vector<std::size_t>{10, std::size_t{200'000}, 0, 7});
}

TEST_CASE("a record of other settings is shown in a short line of ASCII", "[batch]") {
  const TemporaryFolder folder;
  const std::string record = "{\"model\":\"vnreg\"}\n";
  const auto message = [&](const std::string& found) -> std::string {
    const std::string path = folder.write("a.csv.run.json", found);
    try {
      check_record(path, record);
    } catch (const CommandError& error) {
      return std::string(error.what()).substr(path.size());
    }
    return "none";
  };
  CHECK(message(record) == "none");
  CHECK_THAT(message("{\"model\":\"\xc2\x9b" + std::string(1'000'000, 'x') + "\"}"),
             Catch::StartsWith(": expected model \"vnreg\", found \"\\u009bxxxxxxxx") &&
                 Catch::Contains("xxx...; name another output"));
  CHECK(message("[]").starts_with(": expected model \"vnreg\", found null"));
  CHECK(message("[").starts_with(": expected the settings of the run that wrote the rows"));
}

TEST_CASE("a file whose name holds a zero byte is refused, not the one named before it",
          "[batch]") {
  using namespace std::string_literals;
  CHECK_THROWS_WITH(parse_pairs("a.ply,b.ply\na.ply\0x,b.ply\n"s),
                    "line 2: expected a source without a zero byte, found 'a.ply\\x00x'");
  CHECK_THROWS_WITH(parse_pairs("source,target\na.ply,\0\n"s),
                    "line 2: expected a target without a zero byte, found '\\x00'");
  CHECK(parse_pairs("a.ply,b.ply\n").size() == 1);
}

TEST_CASE("rows go on behind what was done, and a row of another run is refused", "[batch]") {
  const TemporaryFolder folder;
  const PairTable table{{{"0", "a.ply", "b.ply"}, {"1", "c.ply", "d.ply"}}, ""};
  const std::string path = folder / "a.jsonl";
  ResultRow row;
  row.id = "0";
  row.source = "a.ply";
  row.target = "b.ply";
  {
    ResultsFile results(path);
    CHECK(results.begin_or_resume(table, "{}\n", false) == 0);
    results.add(row);
  }
  CHECK(ResultsFile(path).begin_or_resume(table, "{}\n", false) == 1);
  row.row = 1;  // but of the first pair
  folder.write("a.jsonl", row_line(row, RowFormat::jsonl));
  CHECK_THROWS_AS(ResultsFile(path).begin_or_resume(table, "{}\n", false), CommandError);
}
