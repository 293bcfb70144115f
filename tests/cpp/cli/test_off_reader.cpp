#include "file_bytes.hpp"

using namespace vnreg::test;

namespace {
const Points two_points{{1, 2, 3}, {-4, 5.5, 6}};
const std::string body = "1 2 3\n-4 5.5 6\n3 0 1 0\n";
}  // namespace

TEST_CASE("OFF: header variants", "[off]") {
  const std::string head =
      GENERATE("OFF\n2 1 0\n", "OFF 2 1 0\n", "OFF2 1 0\n", "# why\n\nOFF # x\n# y\n2 1 0 # z\n",
               "COFF\n2 1 0\n", "NOFF\n2 1 0\n", "CNOFF\n2 1 0\n", "STCNOFF 2 1 0\n", "OFF\n2\n",
               "OFF\r\n2 1 0\r\n");
  INFO(head);
  check_equal(parse_cloud(head + body, ""), two_points);
}

TEST_CASE("OFF: the keyword may be missing where the name says OFF", "[off]") {
  check_equal(parse_cloud("2 1 0\n" + body, "a.off"), two_points);
}

TEST_CASE("OFF: normals and colours after x y z are skipped", "[off]") {
  check_equal(parse_cloud("COFF\n2 0 0\n1 2 3 255 0 0 255\n\n# c\n-4 5.5 6 0 0 0 1 # red", ""),
              two_points);
}

TEST_CASE("OFF: messages", "[off]") {
  CHECK(error_of("4OFF\n2 0 0\n1 2 3 1\n", "") ==
        "line 1: expected OFF with vertices x y z, found '4OFF', which has other dimensions");
  CHECK(error_of("nOFF\n3\n2 0 0\n", "") ==
        "line 1: expected OFF with vertices x y z, found 'nOFF', which has other dimensions");
  CHECK(error_of("OFF BINARY\n", "") == "line 1: expected OFF as text, found 'BINARY'");
  CHECK(error_of("OFF\ntwo 1 0\n", "") == "line 2: expected the number of vertices, found 'two'");
  CHECK(error_of("OFF\n", "") == "line 1: expected the number of vertices, found nothing");
  CHECK(error_of("# only\n", "a.off") == "expected an OFF file, found no line with content");
  CHECK(error_of("OFF\n2 0 0\n1.0 2 3\n1.0 2\n", "") ==
        "line 4: expected a vertex 'x y z', found nothing");
  CHECK(error_of("OFF\n2 0 0\n1.00 2.00 3.00\n", "") ==
        "line 3: expected 2 vertices, found the end of the file after 1");
}

TEST_CASE("OFF: a small file that claims a huge count allocates nothing", "[off]") {
  for (const char* count :
       {"1000000000000000000", "18446744073709551615", "99999999999999999999", "3"}) {
    CHECK_FALSE(survives("OFF\n" + std::string(count) + " 0 0\n1 2 3\n1 2 3", ""));
  }
}

TEST_CASE("OFF: prefixes and mutants are survived", "[off]") {
  check_every_prefix_is_survived("OFF\n2 1 0\n" + body, "a.off");
  check_mutants_are_survived("OFF\n2 1 0\n" + body, "a.off", 2000);
}
