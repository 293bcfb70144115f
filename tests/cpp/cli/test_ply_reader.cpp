#include "file_bytes.hpp"

using namespace vnreg::test;

namespace {

const Points two_points{{1, 2, 3}, {-4, 5.5, 6}};

std::string header(std::string_view format, std::string_view rest) {
  return "ply\nformat " + std::string(format) + " 1.0\n" + std::string(rest) + "end_header\n";
}

constexpr std::string_view plain_vertex =
    "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n";

std::string floats(const Points& points, std::endian order) {
  std::string bytes;
  for (const auto& point : points) {
    for (const double value : point) bytes += bytes_of(static_cast<float>(value), order);
  }
  return bytes;
}

// ---- a writer of random files: any elements, any types, any order ----

enum class Encoding { ascii, little, big };

struct RandomProperty {
  std::string name;
  std::string type;
  std::string count_type;  // not empty for lists
};

struct RandomElement {
  std::string name;
  std::size_t count;
  std::vector<RandomProperty> properties;
};

struct RandomFile {
  Encoding encoding;
  std::vector<RandomElement> elements;
  Points points;
};

const std::vector<std::string> types{"char",   "int8",   "uchar", "uint8",   "short",  "int16",
                                     "ushort", "uint16", "int",   "int32",   "uint",   "uint32",
                                     "int64",  "uint64", "float", "float32", "double", "float64"};

std::string value_bytes(std::string_view type, double value, std::endian order) {
  if (type == "char" || type == "int8") return bytes_of(static_cast<std::int8_t>(value), order);
  if (type == "uchar" || type == "uint8") return bytes_of(static_cast<std::uint8_t>(value), order);
  if (type == "short" || type == "int16") return bytes_of(static_cast<std::int16_t>(value), order);
  if (type == "ushort" || type == "uint16")
    return bytes_of(static_cast<std::uint16_t>(value), order);
  if (type == "int" || type == "int32") return bytes_of(static_cast<std::int32_t>(value), order);
  if (type == "uint" || type == "uint32") return bytes_of(static_cast<std::uint32_t>(value), order);
  if (type == "int64") return bytes_of(static_cast<std::int64_t>(value), order);
  if (type == "uint64") return bytes_of(static_cast<std::uint64_t>(value), order);
  if (type == "float" || type == "float32") return bytes_of(static_cast<float>(value), order);
  return bytes_of(value, order);
}

std::vector<RandomProperty> random_properties(Random& random, std::size_t most,
                                              std::string_view prefix) {
  std::vector<RandomProperty> properties(pick(random, 0, most));
  for (std::size_t i = 0; i < properties.size(); ++i) {
    properties[i].name = std::string(prefix) + std::to_string(i);
    properties[i].type = types[pick(random, 0, types.size() - 1)];
    if (pick(random, 0, 2) == 0) properties[i].count_type = types[pick(random, 0, 13)];
  }
  return properties;
}

RandomFile random_file(Random& random) {
  RandomFile file;
  file.encoding = static_cast<Encoding>(pick(random, 0, 2));
  file.points = whole_points(random, pick(random, 0, 12));
  const std::size_t elements = pick(random, 1, 4);
  const std::size_t vertex = pick(random, 0, elements - 1);
  for (std::size_t i = 0; i < elements; ++i) {
    RandomElement element{"other" + std::to_string(i), pick(random, 0, 5),
                          random_properties(random, 4, "p")};
    if (i == vertex) {
      element = {"vertex", file.points.size(), random_properties(random, 4, "p")};
      for (const char axis : {'x', 'y', 'z'}) {
        const auto at = static_cast<std::ptrdiff_t>(pick(random, 0, element.properties.size()));
        element.properties.insert(
            element.properties.begin() + at,
            {std::string(1, axis), types[pick(random, 0, types.size() - 1)], ""});
      }
    }
    file.elements.push_back(element);
  }
  return file;
}

/// One value of the file: text and a blank, or packed bytes.
std::string one_value(const RandomFile& file, std::string_view type, double value) {
  if (file.encoding == Encoding::ascii) return std::to_string(static_cast<int>(value)) + ' ';
  return value_bytes(type, value,
                     file.encoding == Encoding::big ? std::endian::big : std::endian::little);
}

double value_of(const RandomFile& file, const RandomElement& element,
                const RandomProperty& property, std::size_t row, Random& random) {
  if (element.name == "vertex" && property.name.size() == 1) {
    return file.points[row][static_cast<std::size_t>(property.name[0] - 'x')];
  }
  return static_cast<double>(pick(random, 0, 100));
}

std::string to_bytes(const RandomFile& file, Random& random) {
  static constexpr std::array formats{"ascii", "binary_little_endian", "binary_big_endian"};
  const std::string end = pick(random, 0, 1) == 0 ? "\n" : "\r\n";
  std::string bytes = "ply" + end + "comment made up" + end;
  bytes += std::string("format ") + formats[static_cast<std::size_t>(file.encoding)] + " 1.0" + end;
  for (const RandomElement& element : file.elements) {
    bytes +=
        "element " + element.name + ' ' + std::to_string(element.count) + end + "obj_info x" + end;
    for (const RandomProperty& property : element.properties) {
      bytes += "property ";
      if (!property.count_type.empty()) bytes += "list " + property.count_type + ' ';
      bytes += property.type + ' ' + property.name + end;
    }
  }
  bytes += "end_header" + end;
  for (const RandomElement& element : file.elements) {
    for (std::size_t row = 0; row < element.count; ++row) {
      for (const RandomProperty& property : element.properties) {
        if (property.count_type.empty()) {
          bytes += one_value(file, property.type, value_of(file, element, property, row, random));
          continue;
        }
        const std::size_t items = pick(random, 0, 5);
        bytes += one_value(file, property.count_type, static_cast<double>(items));
        for (std::size_t i = 0; i < items; ++i) {
          bytes += one_value(file, property.type, static_cast<double>(pick(random, 0, 100)));
        }
      }
      if (file.encoding == Encoding::ascii) bytes += end;
    }
  }
  return bytes;
}

}  // namespace

TEST_CASE("PLY: text", "[ply]") {
  const std::string file = header("ascii", plain_vertex) + "1 2 3\n-4 5.5 6\n";
  check_equal(parse_cloud(file, ""), two_points);
  check_equal(parse_cloud(replaced(file, "\n", "\r\n"), ""), two_points);
  check_equal(parse_cloud(replaced(file, "\n", "\r"), ""), two_points);
  check_equal(parse_cloud(file.substr(0, file.size() - 1), ""), two_points);
  check_equal(parse_cloud(replaced(file, "1 2 3\n", "\n  1\t2   3 \n\n"), ""), two_points);
}

TEST_CASE("PLY: binary, both byte orders, any line end of the header", "[ply]") {
  const std::string little = header("binary_little_endian", plain_vertex);
  const std::string big = header("binary_big_endian", plain_vertex);
  for (const char* end : {"\n", "\r\n", "\r"}) {
    check_equal(
        parse_cloud(replaced(little, "\n", end) + floats(two_points, std::endian::little), ""),
        two_points);
    check_equal(parse_cloud(replaced(big, "\n", end) + floats(two_points, std::endian::big), ""),
                two_points);
  }
}

TEST_CASE("PLY: a binary body may begin with the byte of a line end", "[ply]") {
  const std::string vertex =
      "element vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\n";
  const std::string text = header("binary_little_endian", vertex);
  for (const char* end : {"\n", "\r\n", "\r"}) {
    check_equal(parse_cloud(replaced(text, "\n", end) + "\n\r\n", ""), {{10, 13, 10}});
  }
}

TEST_CASE("PLY: doubles keep all their digits", "[ply]") {
  const Points exact{{0.1, 1e300, -1.0 / 3}};
  const std::string vertex =
      "element vertex 1\nproperty double x\nproperty double y\nproperty double z\n";
  std::string file = header("binary_big_endian", vertex);
  for (const double value : exact[0]) file += bytes_of(value, std::endian::big);
  check_equal(parse_cloud(file, ""), exact);
}

TEST_CASE("PLY: random elements, types, orders, lists and encodings", "[ply]") {
  Random random(static_cast<unsigned>(GENERATE(range(0, 400))));
  const RandomFile file = random_file(random);
  const std::string bytes = to_bytes(file, random);
  INFO(bytes.substr(0, bytes.find("end_header")));
  check_equal(parse_cloud(bytes, ""), file.points);
}

TEST_CASE("PLY: coordinates that are not finite are read as they are", "[ply]") {
  const Points points =
      parse_cloud(header("ascii", plain_vertex) + "nan inf -inf\n1e999 0 NaN\n", "");
  CHECK(std::isnan(points.at(0)[0]));
  CHECK(points.at(0)[1] == std::numeric_limits<double>::infinity());
  CHECK(points.at(0)[2] == -std::numeric_limits<double>::infinity());
  CHECK(points.at(1)[0] == std::numeric_limits<double>::infinity());
  CHECK(std::isnan(points.at(1)[2]));
}

TEST_CASE("PLY: every prefix of a file with faces is refused", "[ply]") {
  const std::string elements =
      std::string(plain_vertex) + "element face 1\nproperty list uchar int v\n";
  std::string binary =
      header("binary_little_endian", elements) + floats(two_points, std::endian::little);
  binary += bytes_of(std::uint8_t{3}) + bytes_of(0) + bytes_of(1) + bytes_of(0);
  check_every_prefix_is_refused(binary, "a.ply");
  check_mutants_are_survived(binary, "a.ply", 2000);
  const std::string ascii = header("ascii", elements) + "1 2 3\n-4 5.5 6\n3 0 1 0\n";
  check_every_prefix_is_survived(ascii, "a.ply");
  check_mutants_are_survived(ascii, "a.ply", 2000);
  CHECK_THROWS_AS(parse_cloud(ascii.substr(0, ascii.size() - 4), ""), CloudFileError);
}

TEST_CASE("PLY: bytes after the last element are ignored", "[ply]") {
  check_equal(parse_cloud(header("binary_little_endian", plain_vertex) +
                              floats(two_points, std::endian::little) + "more",
                          ""),
              two_points);
}

TEST_CASE("PLY: messages say the place, what was expected and what was found", "[ply]") {
  const auto file = [](std::string_view text) { return error_of(text, "a.ply"); };
  CHECK(file("solid x\n") == "line 1: expected 'ply', found 'solid x'");
  CHECK(file("ply\nformat ascii 1.0\n") ==
        "line 2: expected 'end_header', found the end of the file");
  CHECK(file("ply\nformat middle_endian 1.0\n") ==
        "line 2: expected the format ascii, binary_little_endian or binary_big_endian, found "
        "'middle_endian'");
  CHECK(file("ply\nelement vertex -3\n") ==
        "line 2: expected 'element NAME COUNT' with a whole number, found '-3'");
  CHECK(file("ply\nelement vertex 3\nproperty flot x\n") ==
        "line 3: expected a property type such as float, double, uchar or int, found 'flot'");
  CHECK(file("ply\nproperty float x\n") ==
        "line 2: expected 'element' before 'property', found none");
  CHECK(
      file("ply\nelement a 1\nproperty list float int v\n") ==
      "line 3: expected a whole-number type for the length of a list, found a floating-point type");
  CHECK(file("ply\nelement a 1\nproperty float\n") ==
        "line 3: expected the name of a property, found nothing");
  CHECK(file("ply\nend_header\n") == "line 2: expected a 'format' line in the header, found none");
  CHECK(file("ply\nwhat\n") ==
        "line 2: expected format, element, property, comment or end_header, found 'what'");
  CHECK(file(header("ascii", "")) == "expected one element 'vertex' in the header, found 0");
  CHECK(file(header("ascii", "element vertex 1\nproperty float x\nproperty float y\n")) ==
        "expected one number 'z' in element 'vertex' of the header, found 0");
  CHECK(file(header("ascii", std::string(plain_vertex) + "property float x\n")) ==
        "expected one number 'x' in element 'vertex' of the header, found 2");
  CHECK(file(header("ascii", plain_vertex) + "1 2 3\n1 x 3\n") ==
        "line 9: expected a number for 'y', found 'x'");
  CHECK(file(header("ascii", plain_vertex) + "1 2 3\n1 2\n       ") ==
        "line 9: expected more values in a row of element 'vertex', found the end of the line");
  CHECK(file(header("ascii", plain_vertex) + "1 2 3 4\n1 2 3 4\n") ==
        "line 8: expected the end of a row of element 'vertex', found '4'");
  CHECK(file(header("ascii", plain_vertex) + "1 2 3        \n") ==
        "line 8: expected 2 rows of element 'vertex', found the end of the file");
  CHECK(file(header("binary_little_endian", plain_vertex) + "abc") ==
        "byte 115: expected 2 rows of element 'vertex', 12 bytes or more each, found 3 bytes up to "
        "the "
        "end of the file");
}

TEST_CASE("PLY: surplus values on rows of text are ignored but for points", "[ply]") {
  const std::string face = "element face 1\nproperty list uchar int v\n";
  check_equal(
      parse_cloud(
          header("ascii", std::string(plain_vertex) + face) + "1 2 3\n-4 5.5 6\n3 0 1 0 9 9\n", ""),
      two_points);
}

TEST_CASE("PLY: two elements 'vertex', or x in a list, are refused", "[ply]") {
  CHECK(error_of(header("ascii", std::string(plain_vertex) + std::string(plain_vertex)), "a.ply") ==
        "expected one element 'vertex' in the header, found 2");
  const std::string list = replaced(plain_vertex, "float x", "list uchar float x");
  CHECK(error_of(header("ascii", list), "a.ply") ==
        "expected one number 'x' in element 'vertex' of the header, found 0");
}

TEST_CASE("PLY: a small file that claims a huge number of rows allocates nothing", "[ply]") {
  const std::string count =
      GENERATE("1000000000000000000", "18446744073709551615", "2147483648", "100");
  const std::string format = GENERATE("ascii", "binary_little_endian", "binary_big_endian");
  const std::string vertex = replaced(plain_vertex, " 2", " " + count);
  CHECK_FALSE(survives(header(format, vertex) + "1 2 3\n", "a.ply"));
  const std::string before = "element face " + count + "\nproperty list uchar int v\n";
  CHECK_FALSE(survives(header(format, before + std::string(plain_vertex)) + "1 2 3\n", "a.ply"));
  const std::string with_list = vertex + "property list uchar int v\n";
  CHECK_FALSE(survives(header(format, with_list) + "1 2 3 0\n", "a.ply"));
}

TEST_CASE("PLY: a list that claims more than the file is refused", "[ply]") {
  const std::string type = GENERATE("char", "uint", "int", "int64", "uint64");
  const std::string face = "element face 1\nproperty list " + type + " double v\n";
  const std::string start =
      header("binary_little_endian", face +
                                         "element vertex 0\nproperty float "
                                         "x\nproperty float y\nproperty float z\n");
  const std::string length(8, '\xff');  // -1, or the largest of the unsigned types
  CHECK_FALSE(survives(start + length, "a.ply"));
  CHECK(error_of(start + length, "a.ply").find("expected a list 'v' that fits the file") !=
        std::string::npos);
}

TEST_CASE("PLY: rows of an element without properties take no space", "[ply]") {
  const std::string elements = "element void 1000000000000000000\n" + std::string(plain_vertex);
  check_equal(parse_cloud(header("ascii", elements) + "1 2 3\n-4 5.5 6\n", ""), two_points);
  check_equal(
      parse_cloud(
          header("binary_little_endian", elements) + floats(two_points, std::endian::little), ""),
      two_points);
}
