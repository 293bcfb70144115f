#include "cloud_file/ply_writer.hpp"

#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>

#include "file_bytes.hpp"
#include "temporary_folder.hpp"

using namespace vnreg::test;
using vnreg::cloud_file::read_cloud;
using vnreg::cloud_file::write_ply;

namespace {
namespace fs = std::filesystem;
}

TEST_CASE("what is written is read back bit by bit", "[ply_writer]") {
  const TemporaryFolder folder;
  Random random(static_cast<unsigned>(GENERATE(range(0, 20))));
  Points points(pick(random, 0, 200));
  std::uniform_real_distribution<double> coordinate(-1e9, 1e9);
  for (auto& point : points) {
    for (double& value : point) value = coordinate(random);
  }
  write_ply(folder / "a.ply", points);
  check_equal(read_cloud(folder / "a.ply"), points);
  CHECK(folder.entries() == 1);
}

TEST_CASE("an older file is replaced, a link stays a link", "[ply_writer]") {
  const TemporaryFolder folder;
  const std::string real = folder.write("real.ply", "old");
  fs::create_symlink("real.ply", folder / "link.ply");
  write_ply(folder / "link.ply", {{1, 2, 3}});
  CHECK(fs::is_symlink(folder / "link.ply"));
  check_equal(read_cloud(real), {{1, 2, 3}});
  CHECK(folder.entries() == 2);
}

TEST_CASE("the file has the rights of any new file", "[ply_writer]") {
  const TemporaryFolder folder;
  const mode_t old = ::umask(027);
  write_ply(folder / "a.ply", {{1, 2, 3}});
  ::umask(old);
  CHECK(fs::status(folder / "a.ply").permissions() == static_cast<fs::perms>(0640));
}

TEST_CASE("a failure leaves nothing behind and the older file as it was", "[ply_writer]") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(
      write_ply(folder / "none/a.ply", {{1, 2, 3}}),
      folder / "none/a.ply" +
          ": expected a folder that can be written to, found No such file or directory");
  fs::create_directory(folder / "dir.ply");
  CHECK_THROWS_WITH(
      write_ply(folder / "dir.ply", {{1, 2, 3}}),
      folder / "dir.ply" + ": expected a file to write, found something else of that name");
  CHECK_THROWS_AS(write_ply("/dev/null", {{1, 2, 3}}), CloudFileError);
  CHECK(folder.entries() == 1);
}

TEST_CASE("a full disk is an error, and nothing is left behind", "[ply_writer]") {
  // A limit on the size of files stands in for the full disk.
  const TemporaryFolder folder;
  const std::string old = folder.write("a.ply", "old");
  struct rlimit before {};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  struct rlimit small = before;
  small.rlim_cur = 4096;
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &small) == 0);
  std::string message;
  try {
    write_ply(old, Points(10000));
  } catch (const CloudFileError& error) {
    message = error.what();
  }
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  CHECK(message == old + ": expected room for the file, found File too large");
  CHECK(fs::file_size(old) == 3);
  CHECK(folder.entries() == 1);
}
