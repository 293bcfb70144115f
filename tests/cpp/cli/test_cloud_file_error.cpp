#include "cloud_file/cloud_file_error.hpp"

#include <catch2/catch.hpp>

using vnreg::cloud_file::one_line;
using vnreg::cloud_file::quoted;

TEST_CASE("messages: no control character reaches a terminal, other characters do") {
  CHECK(one_line("a\nb\x1b[2J\x7f") == "a\\x0ab\\x1b[2J\\x7f");
  CHECK(one_line("\xc2\x80 \xc2\x9b\x32J \xc2\x9f") == "\\xc2\\x80 \\xc2\\x9b2J \\xc2\\x9f");
  const std::string words = "\xc2\xa0 \xc3\x9f \xe2\x82\xac \xf0\x9f\x99\x82 ~";  // beyond U+009F
  CHECK(one_line(words) == words);
  CHECK(one_line("cut \xc2") == "cut \xc2");
  CHECK(one_line("").empty());
}

TEST_CASE("messages: what stands in a file is shown as printable ASCII, and cut off") {
  CHECK(quoted("") == "nothing");
  CHECK(quoted("x\t\xc3\x9f") == "'x\\x09\\xc3\\x9f'");
  CHECK(quoted(std::string(41, 'a')) == "'" + std::string(40, 'a') + "...'");
}
