#include "file_bytes.hpp"
#include "lzf_encoder.hpp"

using namespace vnreg::test;

namespace {

const Points two_points{{1, 2, 3}, {-4, 5.5, 6}};

struct Field {
  std::string name;
  char type;
  std::size_t size;
  std::size_t count;
};

const std::vector<Field> xyz{{"x", 'F', 4, 1}, {"y", 'F', 4, 1}, {"z", 'F', 4, 1}};

std::string header(const std::vector<Field>& fields, const std::string& points,
                   std::string_view data) {
  std::string text = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS";
  for (const Field& field : fields) text += ' ' + field.name;
  text += "\nSIZE";
  for (const Field& field : fields) text += ' ' + std::to_string(field.size);
  text += "\nTYPE";
  for (const Field& field : fields) text += std::string(" ") + field.type;
  text += "\nCOUNT";
  for (const Field& field : fields) text += ' ' + std::to_string(field.count);
  return text + "\nWIDTH " + points + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + points +
         "\nDATA " + std::string(data) + '\n';
}

std::string number_bytes(const Field& field, double value) {
  if (field.type == 'F')
    return field.size == 4 ? bytes_of(static_cast<float>(value)) : bytes_of(value);
  // Whole numbers of either sign, cut to the size of the field.
  return bytes_of(static_cast<std::int64_t>(value)).substr(0, field.size);
}

double value_at(const Points& points, const Field& field, std::size_t point) {
  if (field.name == "x" || field.name == "y" || field.name == "z") {
    return points[point][static_cast<std::size_t>(field.name[0] - 'x')];
  }
  return static_cast<double>(17 + point % 50);
}

/// The points as packed rows, or as columns, field after field.
std::string body(const std::vector<Field>& fields, const Points& points, bool columns) {
  std::string bytes;
  const auto append = [&](const Field& field, std::size_t point) {
    for (std::size_t i = 0; i < field.count; ++i) {
      bytes += number_bytes(field, value_at(points, field, point));
    }
  };
  if (columns) {
    for (const Field& field : fields) {
      for (std::size_t point = 0; point < points.size(); ++point) append(field, point);
    }
  } else {
    for (std::size_t point = 0; point < points.size(); ++point) {
      for (const Field& field : fields) append(field, point);
    }
  }
  return bytes;
}

std::string compressed_body(const std::string& columns) {
  const std::string compressed = lzf_compress(columns);
  return bytes_of(static_cast<std::uint32_t>(compressed.size())) +
         bytes_of(static_cast<std::uint32_t>(columns.size())) + compressed;
}

std::string text_body(const std::vector<Field>& fields, const Points& points) {
  std::string text;
  for (std::size_t point = 0; point < points.size(); ++point) {
    for (const Field& field : fields) {
      for (std::size_t i = 0; i < field.count; ++i) {
        text += std::to_string(value_at(points, field, point)) + ' ';
      }
    }
    text += '\n';
  }
  return text;
}

std::string file(const std::vector<Field>& fields, const Points& points, std::string_view data) {
  const std::string head = header(fields, std::to_string(points.size()), data);
  if (data == "ascii") return head + text_body(fields, points);
  if (data == "binary") return head + body(fields, points, false);
  return head + compressed_body(body(fields, points, true));
}

std::vector<Field> random_fields(Random& random) {
  std::vector<Field> fields;
  for (std::size_t i = pick(random, 0, 4); i > 0; --i) {
    const bool is_float = pick(random, 0, 1) == 0;
    const std::size_t size = std::size_t{1} << pick(random, is_float ? 2 : 0, 3);
    fields.push_back({pick(random, 0, 1) == 0 ? "_" : "rgb",
                      is_float ? 'F' : "IU"[pick(random, 0, 1)], size, pick(random, 0, 5)});
  }
  for (const char axis : {'x', 'y', 'z'}) {
    const bool is_float = pick(random, 0, 1) == 0;
    const std::size_t size = std::size_t{1} << pick(random, is_float ? 2 : 0, 3);
    const auto at = static_cast<std::ptrdiff_t>(pick(random, 0, fields.size()));
    fields.insert(fields.begin() + at,
                  {std::string(1, axis), is_float ? 'F' : "IU"[pick(random, 0, 1)], size, 1});
  }
  return fields;
}

}  // namespace

TEST_CASE("PCD: text, binary and compressed", "[pcd]") {
  const std::string data = GENERATE("ascii", "binary", "binary_compressed");
  check_equal(parse_cloud(file(xyz, two_points, data), ""), two_points);
  check_equal(parse_cloud(file(xyz, {}, data), ""), {});
}

TEST_CASE("PCD: lines of the header may end with CR LF", "[pcd]") {
  check_equal(parse_cloud(replaced(file(xyz, two_points, "ascii"), "\n", "\r\n"), ""), two_points);
  check_equal(
      parse_cloud(replaced(header(xyz, "2", "binary"), "\n", "\r\n") + body(xyz, two_points, false),
                  ""),
      two_points);
}

TEST_CASE("PCD: random fields of any type, size, count and order", "[pcd]") {
  Random random(static_cast<unsigned>(GENERATE(range(0, 200))));
  const std::string data = GENERATE("ascii", "binary", "binary_compressed");
  const std::vector<Field> fields = random_fields(random);
  const Points points = whole_points(random, pick(random, 0, 300));
  check_equal(parse_cloud(file(fields, points, data), ""), points);
}

TEST_CASE("PCD: signed coordinates are signed", "[pcd]") {
  const std::size_t size = GENERATE(1U, 2U, 4U, 8U);
  const std::vector<Field> fields{{"z", 'I', size, 1}, {"x", 'I', size, 1}, {"y", 'I', size, 1}};
  Random random(3);
  const Points points = whole_points(random, 50, -128, 127);
  check_equal(parse_cloud(file(fields, points, "binary"), ""), points);
  check_equal(parse_cloud(file(fields, points, "binary_compressed"), ""), points);
}

TEST_CASE("PCD: COUNT, HEIGHT, POINTS and the first comment may be missing", "[pcd]") {
  const std::string whole = file(xyz, two_points, "ascii");
  for (const char* line :
       {"COUNT 1 1 1\n", "HEIGHT 1\n", "POINTS 2\n", "WIDTH 2\n", "VERSION 0.7\n",
        "VIEWPOINT 0 0 0 1 0 0 0\n", "# .PCD v0.7 - Point Cloud Data file format\n"}) {
    INFO(line);
    REQUIRE(whole.find(line) != std::string::npos);
    check_equal(parse_cloud(replaced(whole, line, ""), ""), two_points);
  }
  check_equal(parse_cloud(replaced(whole, "FIELDS", "COLUMNS"), ""), two_points);
}

TEST_CASE("PCD: an organised cloud keeps its missing points as NaN", "[pcd]") {
  const std::string head =
      replaced(replaced(header(xyz, "4", "ascii"), "WIDTH 4", "WIDTH 2"), "HEIGHT 1", "HEIGHT 2");
  const Points points = parse_cloud(head + "1 2 3\nnan nan nan\n\n4 5 6\n7 8 9\n", "");
  REQUIRE(points.size() == 4);
  CHECK(std::isnan(points[1][0]));
  CHECK(points[3] == std::array<double, 3>{7, 8, 9});
}

TEST_CASE("PCD: every prefix of a binary file is refused", "[pcd]") {
  const std::string data = GENERATE("binary", "binary_compressed");
  const std::string whole = file(xyz, two_points, data);
  check_every_prefix_is_refused(whole, "a.pcd");
  check_mutants_are_survived(whole, "a.pcd", 3000);
}

TEST_CASE("PCD: every prefix of a file of text is survived", "[pcd]") {
  const std::string whole = file(xyz, two_points, "ascii");
  check_every_prefix_is_survived(whole, "a.pcd");
  check_mutants_are_survived(whole, "a.pcd", 3000);
}

TEST_CASE("PCD: bytes after the points are ignored", "[pcd]") {
  check_equal(parse_cloud(file(xyz, two_points, "binary") + std::string(100, '\0'), ""),
              two_points);
}

TEST_CASE("PCD: messages say the place, what was expected and what was found", "[pcd]") {
  const std::string whole = file(xyz, two_points, "ascii");
  const auto error = [&](std::string_view from, std::string_view to) {
    REQUIRE(whole.find(from) != std::string::npos);
    return error_of(replaced(whole, from, to), "a.pcd");
  };
  CHECK(error("SIZE 4", "SIZE 3") == "line 4: expected SIZE 1, 2, 4 or 8, found '3'");
  CHECK(error("SIZE 4 4 4", "SIZE 2 4 4") ==
        "expected SIZE 4 or 8 for the field 'x' of TYPE F, found 2");
  CHECK(error("SIZE 4 4 4", "SIZE 4 4") == "line 4: expected 3 entries, one per field, found 2");
  CHECK(error("TYPE F", "TYPE D") == "line 5: expected TYPE I, U or F, found 'D'");
  CHECK(error("COUNT 1", "COUNT -1") == "line 6: expected COUNT as a whole number, found '-1'");
  CHECK(error("COUNT 1", "COUNT 2") == "expected one field 'x' with COUNT 1, found another COUNT");
  CHECK(error("FIELDS x y z", "FIELDS x y w") == "expected a field 'z' in FIELDS, found none");
  CHECK(error("FIELDS x y z", "FIELDS x y x") == "expected one field 'x' with COUNT 1, found two");
  CHECK(error("FIELDS x y z\n", "") == "line 3: expected FIELDS before SIZE, found none");
  CHECK(error("SIZE 4 4 4\n", "") == "expected a line SIZE in the header, found none");
  CHECK(error("TYPE F F F\n", "") == "expected a line TYPE in the header, found none");
  CHECK(error("POINTS 2", "POINTS 3") == "expected POINTS equal to WIDTH x HEIGHT = 2, found 3");
  CHECK(error("WIDTH 2", "WIDTH two") == "line 7: expected WIDTH as a whole number, found 'two'");
  CHECK(error("DATA ascii", "DATA zip") ==
        "line 11: expected DATA ascii, binary or binary_compressed, found 'zip'");
  CHECK(
      error("DATA ascii", "DOTA ascii") ==
      "line 11: expected a PCD header keyword such as FIELDS, SIZE, POINTS or DATA, found 'DOTA'");
  CHECK(error("1.000000 2.000000 3.000000 \n", "1 2\n") == "line 12: expected 3 numbers, found 2");
  CHECK(error("1.000000 2.000000 3.000000 \n", "1 2 3 4\n") ==
        "line 12: expected 3 numbers, found 4");
  CHECK(error("2.000000", "two") == "line 12: expected a number, found 'two'");
  CHECK(error("1.000000 2.000000 3.000000 \n", "") ==
        "line 12: expected 2 points, found the end of the file after 1");
}

TEST_CASE("PCD: a small file that claims a huge size allocates nothing", "[pcd]") {
  const std::string count =
      GENERATE("1000000000000000000", "18446744073709551615", "4294967296", "50");
  const std::string data = GENERATE("ascii", "binary", "binary_compressed");
  CHECK_FALSE(survives(header(xyz, count, data) + "1 2 3\n\x01\x02\x03\x04\x05\x06", "a.pcd"));
  const std::string wide = replaced(header(xyz, "1", data), "HEIGHT 1", "HEIGHT " + count);
  CHECK_FALSE(survives(replaced(wide, "WIDTH 1", "WIDTH 4294967296"), "a.pcd"));
  const std::string more = replaced(header(xyz, "1", data), "COUNT 1 1 1", "COUNT 1 1 1 " + count);
  const std::string four = replaced(replaced(replaced(more, "y z", "y z w"), "SIZE 4", "SIZE 4 8"),
                                    "TYPE F", "TYPE F F");
  CHECK_FALSE(survives(four + "1 2 3\n", "a.pcd"));
}

TEST_CASE("PCD: an LZF bomb is refused before it is expanded", "[pcd]") {
  const std::string head = header({{"x", 'U', 1, 1}, {"y", 'U', 1, 1}, {"z", 'U', 1, 1}},
                                  "1000000000", "binary_compressed");
  const std::string sizes = bytes_of(std::uint32_t{5}) + bytes_of(std::uint32_t{3000000000U});
  CHECK_FALSE(survives(head + sizes + std::string("\0a\xE0\xFF\0", 5), "a.pcd"));
}

TEST_CASE("PCD: broken compressed bodies are refused", "[pcd]") {
  const std::string head = header(xyz, "2", "binary_compressed");
  const std::string good = compressed_body(body(xyz, two_points, true));
  const auto with = [&](std::uint32_t compressed, std::uint32_t uncompressed) {
    return error_of(head + bytes_of(compressed) + bytes_of(uncompressed) + good.substr(8), "a.pcd");
  };
  const auto length = static_cast<std::uint32_t>(good.size() - 8);
  CHECK(with(length, 25).find("expected an uncompressed size of 24 bytes, found 25") !=
        std::string::npos);
  CHECK(with(length + 1, 24).find("bytes of compressed points, found") != std::string::npos);
  CHECK(with(length - 1, 24).find("expected LZF data that expands to 24 bytes") !=
        std::string::npos);
}
