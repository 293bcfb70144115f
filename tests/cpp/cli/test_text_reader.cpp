#include "file_bytes.hpp"

using namespace vnreg::test;

namespace {
const Points two_points{{1, 2, 3}, {-4, 5.5, 6}};
}

TEST_CASE("text: every delimiter", "[text]") {
  const std::string rows = "1 2 3\n-4 5.5 6\n";
  for (const char* delimiter : {" ", "   ", "\t", ",", ", ", " , ", ";", "; ", " \t ", "\t\t"}) {
    INFO("delimiter '" << delimiter << "'");
    if (std::string_view(delimiter) == "\t\t") {
      // Two tabs are an empty column between them.
      CHECK_THROWS_AS(parse_cloud(replaced(rows, " ", delimiter), "a.txt"), CloudFileError);
    } else {
      check_equal(parse_cloud(replaced(rows, " ", delimiter), "a.csv"), two_points);
    }
  }
}

TEST_CASE("text: line ends, blank lines, comments, byte order mark", "[text]") {
  check_equal(parse_cloud("1 2 3\r\n-4 5.5 6\r\n", "a.xyz"), two_points);
  check_equal(parse_cloud("1 2 3\r-4 5.5 6", "a.xyz"), two_points);
  check_equal(parse_cloud("1 2 3\n-4 5.5 6", "a.xyz"), two_points);
  check_equal(parse_cloud("# x y z\n\n  \n1 2 3\n# more\n//X Y Z\n  -4 5.5 6  \n\n", "a.xyz"),
              two_points);
  check_equal(parse_cloud("\xEF\xBB\xBF"
                          "1 2 3\n-4 5.5 6\n",
                          "a.csv"),
              two_points);
}

TEST_CASE("text: extra columns are ignored", "[text]") {
  check_equal(parse_cloud("1 2 3 chair 0.5\n-4 5.5 6 leg\n", "a.xyz"), two_points);
  check_equal(parse_cloud("1,2,3,255,,\n-4,5.5,6,0,,\n", "a.csv"), two_points);
}

TEST_CASE("text: a header line is skipped", "[text]") {
  check_equal(parse_cloud("x y z\n1 2 3\n-4 5.5 6\n", "a.txt"), two_points);
  check_equal(parse_cloud("east,north,up\n1,2,3\n-4,5.5,6\n", "a.csv"), two_points);
  check_equal(parse_cloud("# c\nX;Y;Z\n1;2;3\n-4;5.5;6\n", "a.csv"), two_points);
  check_equal(parse_cloud("points\n1 2 3\n-4 5.5 6\n", "a.txt"), two_points);
}

TEST_CASE("text: a header that names x, y and z chooses the columns", "[text]") {
  check_equal(parse_cloud("id,Z,label,\"X\",y\n7,3,a,1,2\n8,6,b,-4,5.5\n", "a.csv"), two_points);
  check_equal(parse_cloud("name x y z\nchair 1 2 3\ntable -4 5.5 6\n", "a.txt"), two_points);
  check_equal(parse_cloud("id\tx\ty\tz\n\t1\t2\t3\n\t-4\t5.5\t6\n", "a.txt"), two_points);
}

TEST_CASE("text: quotes are removed and may hold the delimiter", "[text]") {
  check_equal(parse_cloud("\"1\",\"2\",\"3\"\n\"-4\",\"5.5\",\"6\"\n", "a.csv"), two_points);
  check_equal(parse_cloud("name,x,y,z\n\"a, b\",1,2,3\n\"c\",-4,5.5,6\n", "a.csv"), two_points);
  check_equal(parse_cloud("n\tx\ty\tz\n\t\"1\"\t2\t3\n\t-4\t5.5\t6\n", "a.csv"), two_points);
}

TEST_CASE("text: messages", "[text]") {
  CHECK(error_of("# nothing\n", "a.xyz") == "expected rows of three numbers or more, found none");
  CHECK(error_of("x y z\n", "a.xyz") == "expected rows of three numbers or more, found none");
  CHECK(error_of("1 2\n", "a.xyz") == "line 1: expected 3 columns or more, found 2");
  CHECK(error_of("1 2 3\n4 5\n", "a.xyz") == "line 2: expected 3 columns or more, found 2");
  CHECK(error_of("1 2 3\n4 5 six\n", "a.xyz") ==
        "line 2: expected a number in column 3, found 'six'");
  CHECK(error_of("1 2 3\n\n4,5,6\n", "a.xyz") == "line 3: expected 3 columns or more, found 1");
  CHECK(error_of("1,,3\n", "a.csv") == "line 1: expected a number in column 2, found nothing");
  CHECK(error_of("1,5;2,5;3,5\n", "a.csv") == "line 1: expected a number in column 1, found '1,5'");
  CHECK(error_of("x y z\na b c\n1 2 3\n", "a.xyz") ==
        "line 2: expected a number in column 1, found 'a'");
  // A first row with a slip of the pen is no header.
  CHECK(error_of("1.0 2.O 3.0\n1 2 3\n", "a.xyz") ==
        "line 1: expected a number in column 2, found '2.O'");
  CHECK(error_of("1,5;2,5\n1 2 3\n", "a.xyz") ==
        "line 1: expected a number in column 2, found '5;2'");
  CHECK(error_of("5\nchemistry\nC 0 0 0\n", "a.xyz") ==
        "line 1: expected 3 columns or more, found 1");
  CHECK(error_of("id,x,y,z\n1,2,3\n", "a.csv") == "line 2: expected 4 columns or more, found 3");
}

TEST_CASE("text: random rows of every delimiter come back exactly", "[text]") {
  Random random(static_cast<unsigned>(GENERATE(range(0, 100))));
  static constexpr std::array delimiters{" ", "\t", ",", ";", ", "};
  const std::string delimiter = delimiters[pick(random, 0, 4)];
  const std::string end = pick(random, 0, 1) == 0 ? "\n" : "\r\n";
  std::uniform_real_distribution<double> coordinate(-1e6, 1e6);
  Points points(pick(random, 1, 40));
  std::string text;
  if (pick(random, 0, 1) == 0) text = "x" + delimiter + "y" + delimiter + "z" + end;
  for (auto& point : points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      point[axis] = coordinate(random);
      char number[40];
      std::snprintf(number, sizeof(number), pick(random, 0, 1) == 0 ? "%.17g" : "%.17e",
                    point[axis]);
      if (axis > 0) text += delimiter;
      text += number;
    }
    if (pick(random, 0, 1) == 0) text += delimiter + "extra";
    text += end;
  }
  check_equal(parse_cloud(text, "a.txt"), points);
}

TEST_CASE("text: prefixes and mutants are survived", "[text]") {
  const std::string rows = "id,x,y,z\n\"a,b\",1,2,3\nc,-4,5.5e1,nan\n";
  check_every_prefix_is_survived(rows, "a.csv");
  check_mutants_are_survived(rows, "a.csv", 3000);
  check_every_prefix_is_survived("1 2 3\n-4 5.5 6\n", "a.xyz");
}
