// Files on disk, and paths that are no files.
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

Error open_error(const std::string& path) {
  std::optional<Error> error;
  try {
    read_file(path);
  } catch (const Error& caught) {
    error = caught;
  }
  REQUIRE(error.has_value());
  CHECK(error->code() == ErrorCode::file_unreadable);
  return *error;
}

Bytes contents(const AlignedBytes& file) {
  return {reinterpret_cast<const char*>(file.span().data()), file.span().size()};
}

TEST_CASE("files: sizes round the page are read whole") {
  const Folder folder;
  for (const std::size_t size : {1u, 4095u, 4096u, 4097u, 200000u}) {
    Bytes bytes(size, 'x');
    bytes.back() = 'y';
    CHECK(contents(read_file(folder.write("sized", bytes))) == bytes);
  }
}

TEST_CASE("files: what was read stays when the file is changed, cut, deleted") {
  const Folder folder;
  const Bytes bytes = small_draft().build();
  const std::string path = folder.write("model.vnr", bytes);
  AlignedBytes first = read_file(path);
  const ModelFile model = ModelFile::parse(std::as_const(first).span());
  const std::span<const float> weights = model.tensor_f32("a.weight", {2, 3});
  folder.write("model.vnr", Bytes(bytes.size(), 'x'));
  CHECK(weights[2] == 3.5F);
  fs::resize_file(path, 1);
  CHECK(weights[2] == 3.5F);
  fs::remove(path);
  CHECK(contents(first) == bytes);
  const AlignedBytes second = std::move(first);
  CHECK(weights[2] == 3.5F);
  CHECK(contents(first).empty());  // NOLINT(*-move,*.Move): the promise
}

#ifdef __linux__
TEST_CASE("files: nothing stays mapped or open") {
  const Folder folder;
  const std::string path = folder.write("model.vnr", small_draft().build());
  const AlignedBytes file = read_file(path);
  std::ifstream maps("/proc/self/maps");
  const Bytes text{std::istreambuf_iterator<char>(maps), {}};
  CHECK(text.find(path) == Bytes::npos);
  for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
    std::error_code ignored;
    CHECK(fs::read_symlink(entry.path(), ignored) != path);
  }
}

TEST_CASE("files: a file that ends before the size it had is refused") {
  // The kernel says 4096 bytes of this one and has fewer.
  const std::string path = "/sys/devices/system/cpu/online";
  if (!fs::exists(path) || fs::file_size(path) != 4096) return;
  CHECK_THAT(open_error(path).got(), Catch::Contains("it shrank while it was read"));
}
#endif

TEST_CASE("files: a missing file is refused by name") {
  const Folder folder;
  const Error error = open_error(folder.at("absent.vnr"));
  CHECK_THAT(error.field(), Catch::Contains("absent.vnr"));
  CHECK_THAT(error.got(), Catch::Contains("No such file"));
  open_error("");
}

TEST_CASE("files: a directory is refused") {
  const Folder folder;
  CHECK(open_error(folder.at(".")).got() == "a directory");
}

TEST_CASE("files: a pipe is refused without waiting for its writer") {
  const Folder folder;
  const std::string path = folder.at("pipe");
  REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
  CHECK(open_error(path).got() == "a pipe or a device");
}

TEST_CASE("files: an endless device is refused") {
  CHECK(open_error("/dev/zero").got() == "a pipe or a device");
}

TEST_CASE("files: an empty file opens and is not a model") {
  const Folder folder;
  const AlignedBytes file = read_file(folder.write("empty", ""));
  CHECK(file.span().empty());
  CHECK_THROWS_AS(ModelFile::parse(file.span()), Error);
  check_refused("", ErrorCode::not_a_model, "magic");
}

TEST_CASE("files: a file over 1 GiB is refused before it is read") {
  const Folder folder;
  const std::string path = folder.write("sparse", "x");
  fs::resize_file(path, (std::uintmax_t{1} << 30) + 1);  // holes: takes no space on the disk
  CHECK_THAT(open_error(path).expected(), Catch::Contains("1073741824"));
}

TEST_CASE("files: a path with a zero byte does not open what stands before it") {
  const Folder folder;
  const std::string path = folder.write("model.vnr", small_draft().build());
  open_error(path + std::string("\0.bak", 5));
}

TEST_CASE("files: a link is followed, a link into nothing is refused") {
  const Folder folder;
  const std::string target = folder.write("model.vnr", "text");
  fs::create_symlink(target, folder.at("link"));
  fs::create_symlink(folder.at("nowhere"), folder.at("broken"));
  CHECK(contents(read_file(folder.at("link"))) == "text");
  open_error(folder.at("broken"));
}

}  // namespace
}  // namespace vnreg::model_format::test
