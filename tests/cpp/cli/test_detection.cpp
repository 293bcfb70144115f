#include "file_bytes.hpp"

using namespace vnreg::test;
using vnreg::cloud_file::detect_format;
using vnreg::cloud_file::Format;

TEST_CASE("the content decides before the extension", "[detection]") {
  CHECK(detect_format("ply\nformat ascii 1.0\n", "a.xyz") == Format::ply);
  CHECK(detect_format("ply\r\nformat ascii 1.0\r\n", "") == Format::ply);
  CHECK(detect_format("\x93NUMPY\x01", "a.ply") == Format::npy);
  CHECK(detect_format("# .PCD v0.7\nVERSION 0.7\n", "a.txt") == Format::pcd);
  CHECK(detect_format("# note\nVERSION 0.7\n", "") == Format::pcd);
  CHECK(detect_format("OFF\n8 6 0\n", "a.txt") == Format::off);
  CHECK(detect_format("OFF8 6 0\n", "") == Format::off);
  CHECK(detect_format("# c\nv 1 2 3\n", "a.txt") == Format::obj);
  CHECK(detect_format("mtllib x.mtl\n", "") == Format::obj);
}

TEST_CASE("the extension decides where the content does not", "[detection]") {
  CHECK(detect_format("o thing\n", "dir.x/a.OBJ") == Format::obj);
  CHECK(detect_format("2 1 0\n1 2 3\n", "a.off") == Format::off);
  CHECK(detect_format("x y z\n", "a.Csv") == Format::text);
  CHECK(detect_format("1 2 3\n", "a.xyz") == Format::text);
  CHECK(detect_format("garbage", "a.pcd") == Format::pcd);
  CHECK(detect_format("v x y z\n", "a.txt") == Format::text);
  CHECK(detect_format("# scan.PCD exported\n1 2 3\n", "a.txt") == Format::text);
}

TEST_CASE("rows of numbers are text under any name", "[detection]") {
  CHECK(detect_format("1 2 3\n", "/dev/fd/63") == Format::text);
  CHECK(detect_format("# c\n1;2;3\n", "a.pts") == Format::text);
  CHECK_FALSE(detect_format("1 2\n", "a.dat").has_value());
  CHECK_FALSE(detect_format("x y z\n1 2 3\n", "a.dat").has_value());
}

TEST_CASE("an unknown format is refused with those that are known", "[detection]") {
  CHECK(error_of("solid cube\nfacet normal 0 0 1\n", "a.stl") ==
        "expected a point cloud as PLY, PCD, OBJ, OFF, XYZ, TXT, CSV or NPY, found a file that "
        "begins "
        "'solid cube\\x0afacet'");
  CHECK(error_of(std::string("PK\x03\x04\0", 5), "a.npz").find("begins 'PK\\x03\\x04\\x00'") !=
        std::string::npos);
  CHECK(error_of("", "a.ply") == "expected a point cloud, found an empty file");
}

TEST_CASE("random bytes are survived under every name", "[detection]") {
  Random random(static_cast<unsigned>(GENERATE(range(0, 300))));
  static constexpr std::array starts{"",      "ply\n", "\x93NUMPY\x01", "# .PCD\n", "OFF",
                                     "OFF\n", "v ",    "VERSION 1\n",   "1 2 3\n",  "\xEF\xBB\xBF"};
  std::string bytes = starts[pick(random, 0, starts.size() - 1)];
  for (std::size_t i = pick(random, 0, 200); i > 0; --i)
    bytes += static_cast<char>(pick(random, 0, 255));
  for (const char* path : {"a.ply", "a.pcd", "a.obj", "a.off", "a.xyz", "a.npy", "a"}) {
    survives(bytes, path);
  }
}
