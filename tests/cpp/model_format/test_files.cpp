// Files on disk, both ways of access, and paths that are no files.
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "refusals.hpp"

namespace vnreg::model_format::test {
namespace {

namespace fs = std::filesystem;

class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "vnreg_model_format_XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = pattern;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string write(const std::string& name, const Bytes& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return (path_ / name).string();
  }
  std::string at(const std::string& name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

Error open_error(const std::string& path, Access access) {
  std::optional<Error> error;
  try {
    FileBytes::open(path, access);
  } catch (const Error& caught) {
    error = caught;
  }
  REQUIRE(error.has_value());
  CHECK(error->code() == ErrorCode::file_unreadable);
  return *error;
}

Bytes contents(const FileBytes& file) {
  return {reinterpret_cast<const char*>(file.span().data()), file.span().size()};
}

TEST_CASE("files: reading and mapping give equal bytes and equal tensors") {
  const Folder folder;
  const Bytes bytes = small_draft().build();
  const std::string path = folder.write("model.vnr", bytes);
  const FileBytes read = FileBytes::open(path);
  const FileBytes mapped = FileBytes::open(path, Access::map);
  REQUIRE(contents(read) == bytes);
  REQUIRE(contents(mapped) == bytes);
  const ModelFile one = ModelFile::parse(read.span());
  const ModelFile other = ModelFile::parse(mapped.span());
  CHECK(one.metadata() == other.metadata());
  CHECK(one.checksum() == other.checksum());
  REQUIRE(one.tensors().size() == 3);
  for (const auto& [name, tensor] : one.tensors()) {
    const Tensor& twin = other.tensors().find(name)->second;
    CHECK(tensor.shape == twin.shape);
    CHECK(tensor.dtype == twin.dtype);
    CHECK(std::ranges::equal(tensor.bytes, twin.bytes));
  }
}

TEST_CASE("files: sizes round the page are read and mapped whole") {
  const Folder folder;
  for (const std::size_t size : {1u, 4095u, 4096u, 4097u, 200000u}) {
    Bytes bytes(size, 'x');
    bytes.back() = 'y';
    const std::string path = folder.write("sized", bytes);
    CHECK(contents(FileBytes::open(path, Access::read)) == bytes);
    CHECK(contents(FileBytes::open(path, Access::map)) == bytes);
  }
}

TEST_CASE("files: the bytes survive the file's deletion and the owner's moves") {
  const Folder folder;
  const Access access = GENERATE(Access::read, Access::map);
  const Bytes bytes = small_draft().build();
  const std::string path = folder.write("model.vnr", bytes);
  FileBytes first = FileBytes::open(path, access);
  fs::remove(path);
  FileBytes second = std::move(first);
  CHECK(contents(second) == bytes);
  CHECK(first.span().empty());  // NOLINT(*-move,*.Move): the promise
  second = FileBytes::open(folder.write("other", "other"), access);
  CHECK(contents(second) == "other");
}

#ifdef __linux__
TEST_CASE("files: a mapping ends with its owner") {
  const Folder folder;
  const std::string path = folder.write("model.vnr", small_draft().build());
  const auto mapped = [&] {
    std::ifstream maps("/proc/self/maps");
    const Bytes text{std::istreambuf_iterator<char>(maps), {}};
    return text.find(path) != Bytes::npos;
  };
  {
    const FileBytes file = FileBytes::open(path, Access::map);
    CHECK(mapped());
  }
  CHECK_FALSE(mapped());
}
#endif

TEST_CASE("files: a missing file is refused by name") {
  const Folder folder;
  const Access access = GENERATE(Access::read, Access::map);
  const Error error = open_error(folder.at("absent.vnr"), access);
  CHECK_THAT(error.field(), Catch::Contains("absent.vnr"));
  CHECK_THAT(error.got(), Catch::Contains("No such file"));
  open_error("", access);
}

TEST_CASE("files: a directory is refused") {
  const Folder folder;
  const Access access = GENERATE(Access::read, Access::map);
  CHECK(open_error(folder.at("."), access).got() == "a directory");
}

TEST_CASE("files: a pipe is refused without waiting for its writer") {
  const Folder folder;
  const std::string path = folder.at("pipe");
  REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
  CHECK(open_error(path, Access::read).got() == "a pipe or a device");
}

TEST_CASE("files: an endless device is refused") {
  CHECK(open_error("/dev/zero", Access::read).got() == "a pipe or a device");
}

TEST_CASE("files: an empty file opens and is not a model") {
  const Folder folder;
  const Access access = GENERATE(Access::read, Access::map);
  const FileBytes file = FileBytes::open(folder.write("empty", ""), access);
  CHECK(file.span().empty());
  CHECK_THROWS_AS(ModelFile::parse(file.span()), Error);
  check_refused("", ErrorCode::not_a_model, "magic");
}

TEST_CASE("files: a file over 1 GiB is refused before it is read") {
  const Folder folder;
  const Access access = GENERATE(Access::read, Access::map);
  const std::string path = folder.write("sparse", "x");
  fs::resize_file(path, (std::uintmax_t{1} << 30) + 1);  // holes: takes no space on the disk
  CHECK_THAT(open_error(path, access).expected(), Catch::Contains("1073741824"));
}

TEST_CASE("files: a path with a zero byte does not open what stands before it") {
  const Folder folder;
  const std::string path = folder.write("model.vnr", small_draft().build());
  open_error(path + std::string("\0.bak", 5), Access::read);
}

TEST_CASE("files: a link is followed, a link into nothing is refused") {
  const Folder folder;
  const std::string target = folder.write("model.vnr", "text");
  fs::create_symlink(target, folder.at("link"));
  fs::create_symlink(folder.at("nowhere"), folder.at("broken"));
  CHECK(contents(FileBytes::open(folder.at("link"))) == "text");
  open_error(folder.at("broken"), Access::map);
}

}  // namespace
}  // namespace vnreg::model_format::test
