#include "file_bytes.hpp"

using namespace vnreg::test;

namespace {

const Points two_points{{1, 2, 3}, {-4, 5.5, 6}};

std::string npy(int version, std::string dict, std::string_view data) {
  dict += '\n';
  std::string bytes = "\x93NUMPY";
  bytes += static_cast<char>(version);
  bytes += '\0';
  bytes += version == 1 ? bytes_of(static_cast<std::uint16_t>(dict.size()))
                        : bytes_of(static_cast<std::uint32_t>(dict.size()));
  return bytes + dict + std::string(data);
}

std::string dict(std::string_view descr, bool fortran, std::string_view shape) {
  return "{'descr': '" + std::string(descr) +
         "', 'fortran_order': " + (fortran ? "True" : "False") +
         ", 'shape': " + std::string(shape) + ", }";
}

std::string value_bytes(std::string_view type, double value, std::endian order) {
  if (type == "f4") return bytes_of(static_cast<float>(value), order);
  if (type == "f8") return bytes_of(value, order);
  if (type == "i1") return bytes_of(static_cast<std::int8_t>(value), order);
  if (type == "i2") return bytes_of(static_cast<std::int16_t>(value), order);
  if (type == "i4") return bytes_of(static_cast<std::int32_t>(value), order);
  if (type == "i8") return bytes_of(static_cast<std::int64_t>(value), order);
  if (type == "u1") return bytes_of(static_cast<std::uint8_t>(value), order);
  if (type == "u2") return bytes_of(static_cast<std::uint16_t>(value), order);
  if (type == "u4") return bytes_of(static_cast<std::uint32_t>(value), order);
  return bytes_of(static_cast<std::uint64_t>(value), order);
}

/// An array of `columns` columns whose first three are the points.
std::string data(const Points& points, std::size_t columns, std::string_view type,
                 std::endian order, bool fortran) {
  std::string bytes;
  const std::size_t outer = fortran ? columns : points.size();
  const std::size_t inner = fortran ? points.size() : columns;
  for (std::size_t i = 0; i < outer; ++i) {
    for (std::size_t j = 0; j < inner; ++j) {
      const std::size_t row = fortran ? j : i;
      const std::size_t column = fortran ? i : j;
      bytes += value_bytes(type, column < 3 ? points[row][column] : 99, order);
    }
  }
  return bytes;
}

const std::string good =
    npy(1, dict("<f8", false, "(2, 3)"), data(two_points, 3, "f8", std::endian::little, false));

}  // namespace

TEST_CASE("NPY: every type, byte order, memory order, version and width", "[npy]") {
  const std::string type = GENERATE("f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8");
  const bool big = GENERATE(false, true);
  const bool fortran = GENERATE(false, true);
  const int version = GENERATE(1, 2, 3);
  const std::size_t columns = GENERATE(3U, 4U, 7U);
  Random random(5);
  const Points points = whole_points(random, 9);
  const std::string shape = "(9, " + std::to_string(columns) + ")";
  const std::string one_byte = type[1] == '1' ? "|" : (big ? ">" : "<");
  const auto order = big ? std::endian::big : std::endian::little;
  check_equal(parse_cloud(npy(version, dict(one_byte + type, fortran, shape),
                              data(points, columns, type, order, fortran)),
                          ""),
              points);
}

TEST_CASE("NPY: the spelling of the header is free", "[npy]") {
  const std::string body = data(two_points, 3, "f8", std::endian::little, false);
  for (const char* text :
       {"{\"shape\":(2,3),\"fortran_order\":False,\"descr\":\"<f8\"}",
        " { 'shape' : ( 2L , 3L , ) , 'descr' : '<f8' , 'fortran_order' : False }   ",
        "{'descr': '=f8', 'fortran_order': False, 'shape': (2, 3)}"}) {
    INFO(text);
    check_equal(parse_cloud(npy(1, text, body), ""), two_points);
  }
}

TEST_CASE("NPY: no rows, and bytes after the array", "[npy]") {
  check_equal(parse_cloud(npy(1, dict("<f8", false, "(0, 3)"), ""), ""), {});
  // Rows so wide that the count of their bytes would wrap: `make sanitize` would see it.
  check_equal(parse_cloud(npy(1, dict("<f8", false, "(0, 18446744073709551615)"), ""), ""), {});
  check_equal(parse_cloud(good + "more", ""), two_points);
}

TEST_CASE("NPY: messages", "[npy]") {
  const auto error = [](std::string_view descr, std::string_view shape) {
    return error_of(npy(1, dict(descr, false, shape), std::string(240, '\0')), "");
  };
  CHECK(error("<f8", "(3, 10)") ==
        "expected the shape (N, 3), found (3, 10): transpose it, one point per row");
  CHECK(error("<f8", "(10, 2)") == "expected the shape (N, 3 or more), found (10, 2)");
  CHECK(error("<f8", "(30,)") == "expected the shape (N, 3 or more), found (30,)");
  CHECK(error("<f8", "()") == "expected the shape (N, 3 or more), found ()");
  CHECK(error("<f8", "(1, 10, 3)") == "expected the shape (N, 3 or more), found (1, 10, 3)");
  CHECK(error("<f2", "(10, 3)") ==
        "expected the dtype float32, float64 or a whole number of 1, 2, 4 or 8 bytes, found '<f2'");
  CHECK(error("|O", "(10, 3)").find("found '|O'") != std::string::npos);
  CHECK(error("<f8", "(-1, 3)").find("expected a whole number, found '-1, 3)") !=
        std::string::npos);
  CHECK(error("<f8", "(99999999999999999999, 3)").find("expected a whole number") !=
        std::string::npos);
  CHECK(error("<f8", "(11, 3)").find("found 240 bytes up to the end of the file") !=
        std::string::npos);
  CHECK(error_of("NUMPY", "a.npy") == "byte 0: expected '\\x93NUMPY', found 'NUMPY'");
  CHECK(error_of(npy(4, dict("<f8", false, "(0, 3)"), ""), "") ==
        "byte 6: expected version 1, 2 or 3, found 4");
  CHECK(error_of(npy(1, "{'descr': [('x', '<f8')], 'fortran_order': False, 'shape': (2,)}", ""), "")
            .find("expected a string (arrays with named fields are not points)") !=
        std::string::npos);
  CHECK(error_of(npy(1, "{'descr': '<f8', 'shape': (2, 3)}", ""), "")
            .find("expected descr, fortran_order and shape") != std::string::npos);
  CHECK(error_of(npy(1, "{'descr': '<f8', 'shape': (2, 3), 'x': 1}", ""), "").find("not 'x'") !=
        std::string::npos);
}

TEST_CASE("NPY: every prefix is refused, mutants are survived", "[npy]") {
  check_every_prefix_is_refused(good, "a.npy");
  check_mutants_are_survived(good, "a.npy", 3000);
}

TEST_CASE("NPY: a small file that claims a huge array allocates nothing", "[npy]") {
  for (const char* shape :
       {"(1000000000000000000, 3)", "(18446744073709551615, 3)", "(6148914691236517206, 3)",
        "(2, 9223372036854775809)", "(4294967296, 4294967296)", "(100, 3)"}) {
    for (const bool fortran : {false, true}) {
      CHECK_FALSE(survives(npy(2, dict("<f8", fortran, shape), "12345678"), "a.npy"));
    }
  }
  std::string long_header = good;
  long_header[8] = '\xff';
  long_header[9] = '\xff';
  CHECK_FALSE(survives(long_header, "a.npy"));
}
