#include <sys/stat.h>

#include <thread>

#include "file_bytes.hpp"
#include "temporary_folder.hpp"

using namespace vnreg::test;
using vnreg::cloud_file::read_cloud;

namespace {

std::string read_error(const std::string& path) {
  try {
    read_cloud(path);
  } catch (const CloudFileError& error) {
    return error.what();
  }
  FAIL("no error from " << path);
  return {};
}

}  // namespace

TEST_CASE("a file is read, and errors name it", "[read_cloud]") {
  const TemporaryFolder folder;
  check_equal(read_cloud(folder.write("a.xyz", "1 2 3\n4 5 6\n")), {{1, 2, 3}, {4, 5, 6}});
  const std::string bad = folder.write("b.xyz", "1 2 three\n");
  CHECK(read_error(bad) == bad + ": line 1: expected a number in column 3, found 'three'");
  const std::string empty = folder.write("c.ply", "");
  CHECK(read_error(empty) == empty + ": expected a point cloud, found an empty file");
}

TEST_CASE("files that cannot be read", "[read_cloud]") {
  const TemporaryFolder folder;
  CHECK(read_error(folder / "none.ply") ==
        folder / "none.ply" +
            ": expected a file that can be read, found No such file or directory");
  CHECK(read_error(folder / "") == folder / "" + ": expected a file, found a directory");
  CHECK(read_error("") == ": expected a file that can be read, found No such file or directory");
}

TEST_CASE("a name with a line end gives a message of one line", "[read_cloud]") {
  CHECK(read_error("no\nsuch.ply").starts_with("no\\x0asuch.ply: expected a file"));
}

TEST_CASE("a file larger than one piece is read whole", "[read_cloud]") {
  const TemporaryFolder folder;
  std::string text;
  Points expected;
  for (int i = 0; i < 60000; ++i) {
    text += std::to_string(i) + " 0.5 -1\n";
    expected.push_back({static_cast<double>(i), 0.5, -1});
  }
  check_equal(read_cloud(folder.write("big.xyz", text)), expected);
}

TEST_CASE("a pipe is read to its end", "[read_cloud]") {
  const TemporaryFolder folder;
  const std::string path = folder / "pipe";
  REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
  std::thread writer([&] { std::ofstream(path) << "1 2 3\n" << std::flush << "4 5 6\n"; });
  const Points points = read_cloud(path);
  writer.join();
  check_equal(points, {{1, 2, 3}, {4, 5, 6}});
}
