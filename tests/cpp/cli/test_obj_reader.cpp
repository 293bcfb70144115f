#include "file_bytes.hpp"

using namespace vnreg::test;

namespace {
const Points two_points{{1, 2, 3}, {-4, 5.5, 6}};
const std::string cube_like =
    "# made up\nmtllib a.mtl\no thing\nv 1 2 3\nvn 0 0 1\nvt 0.5 0.5\nv -4 5.5 6\nf 1//1 2//1 "
    "1//1\n";
}  // namespace

TEST_CASE("OBJ: the vertices, and nothing else", "[obj]") {
  check_equal(parse_cloud(cube_like, "a.obj"), two_points);
  check_equal(parse_cloud(replaced(cube_like, "\n", "\r\n"), "a.obj"), two_points);
  check_equal(parse_cloud("v 1 2 3\nv -4 5.5 6", "a.obj"), two_points);
  check_equal(parse_cloud("  v\t1   2\t3  \nv -4 5.5 6 1.0", "a.obj"), two_points);
  check_equal(parse_cloud("v 1 2 3 0.1 0.2 0.3\nv -4 5.5 6 0.1 0.2 0.3\n", "a.obj"), two_points);
}

TEST_CASE("OBJ: a backslash continues a line", "[obj]") {
  check_equal(parse_cloud("v 1 \\\n2 \\\r\n 3\nv -4 5.5 6\n", "a.obj"), two_points);
  CHECK(error_of("v 1 2 \\", "a.obj") ==
        "line 1: expected 'v x y z' with three numbers, found nothing");
}

TEST_CASE("OBJ: messages", "[obj]") {
  CHECK(error_of("v 1 2 3\nv 1 2\n", "a.obj") ==
        "line 2: expected 'v x y z' with three numbers, found nothing");
  CHECK(error_of("v 1 2 3\nv 1 2 x3\n", "a.obj") ==
        "line 2: expected 'v x y z' with three numbers, found 'x3'");
  CHECK(error_of("f 1 2 3\nf 1 2 3", "a.obj") ==
        "expected lines 'v x y z' of an OBJ file, found none in 2 lines");
}

TEST_CASE("OBJ: prefixes and mutants are survived", "[obj]") {
  check_every_prefix_is_survived(cube_like, "a.obj");
  check_mutants_are_survived(cube_like, "a.obj", 2000);
}
