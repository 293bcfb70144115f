// Headers that lie, under checksums that are right.
#include <limits>

#include "refusals.hpp"

namespace vnreg::model_format::test {
namespace {

constexpr std::uint64_t huge = std::numeric_limits<std::uint64_t>::max();

TEST_CASE("header: a newer major version is refused and both versions are named") {
  Draft draft = small_draft();
  draft.major = 2;
  draft.minor = 7;
  const Error error = check_refused(draft.build(), ErrorCode::unsupported_version, "major version");
  CHECK_THAT(error.expected(), Catch::Contains("1.0"));
  CHECK_THAT(error.got(), Catch::Contains("2.7"));
}

TEST_CASE("header: the version is judged before any field that a newer version may redefine") {
  const Bytes bytes = Draft{}.magic + u32(2) + u32(0) + Bytes(48, '\xff');
  check_refused(bytes, ErrorCode::unsupported_version, "major version");
}

TEST_CASE("header: major version 0 and the largest are refused") {
  for (const std::uint32_t major : {0u, 0xffffffffu}) {
    Draft draft = small_draft();
    draft.major = major;
    check_refused(draft.build(), ErrorCode::unsupported_version, "major version");
  }
}

TEST_CASE("header: a newer minor version is read with equal content") {
  Draft draft = small_draft();
  const Parsed old = parse(draft.build());
  draft.minor = GENERATE(1u, 0xffffffffu);
  const Parsed newer = parse(draft.build());
  CHECK(newer.file.metadata() == old.file.metadata());
  CHECK(newer.file.tensors().size() == old.file.tensors().size());
  CHECK(newer.file.checksum() != old.file.checksum());
}

TEST_CASE("header: a newer minor version loosens no rule") {
  Draft draft = small_draft();
  draft.minor = 1;
  draft.metadata += entry("z", 5, "");
  check_corrupt(draft.build(), "metadata \"z\" type");
}

TEST_CASE("header: each wrong checksum is refused") {
  Draft head = small_draft();
  head.head_checksum_error = GENERATE(1u, 0x80000000u);
  check_corrupt(head.build(), "head checksum (byte 60)");
  Draft data = small_draft();
  data.data_checksum_error = head.head_checksum_error;
  check_corrupt(data.build(), "data checksum (byte 56)");
}

TEST_CASE("header: a wrong file size is refused") {
  Draft draft = small_draft();
  const std::uint64_t right = draft.build().size();
  for (const std::uint64_t size : {std::uint64_t{0}, right - 1, right + 1, right - 64, right + 64,
                                   std::uint64_t{1} << 30, (std::uint64_t{1} << 30) + 1, huge}) {
    draft.file_size = size;
    check_corrupt(draft.build(), "file size (byte 16)");
  }
}

TEST_CASE("header: more metadata than 1 MiB or than the file is refused") {
  Draft draft = small_draft();
  for (const std::uint64_t size : {(std::uint64_t{1} << 20) + 1, huge, huge - 63}) {
    draft.metadata_bytes = size;
    check_corrupt(draft.build(), "metadata bytes (byte 24)");
  }
  draft.metadata_bytes = std::uint64_t{1} << 20;
  check_corrupt(draft.build(), "data offset (byte 40)");
}

TEST_CASE("header: metadata that ends before or after its last entry is refused") {
  Draft draft = small_draft();
  for (std::uint64_t size = 0; size <= 192; ++size) {
    draft.metadata_bytes = size;
    if (size != draft.metadata.size() && !refusal(draft.build())) FAIL("accepted " << size);
  }
}

TEST_CASE("header: more tensors than 65,536 are refused before the table is looked at") {
  Draft draft = small_draft();
  draft.tensor_count = GENERATE(std::uint64_t{65537}, std::uint64_t{1} << 32, huge);
  check_corrupt(draft.build(), "tensor count (byte 32)");
}

TEST_CASE("header: a tensor count that is not the number of entries is refused") {
  Draft draft = small_draft();
  draft.tensor_count = 2;
  check_corrupt(draft.build(), "padding after the tensor table");
  draft.tensor_count = 4;
  check_corrupt(draft.build(), "name of tensor 3");
  draft.tensor_count = 65536;
  check_corrupt(draft.build(), "name of tensor 3");
  draft.tensor_count = 0;
  check_corrupt(draft.build(), "data offset (byte 40)");
}

TEST_CASE("header: a data offset that is unaligned or outside the file is refused") {
  Draft draft = small_draft();
  const Bytes bytes = draft.build();
  const std::uint64_t right = bytes.size() - draft.data.size();
  for (const std::uint64_t offset : {std::uint64_t{0}, std::uint64_t{64}, right + 1, right + 32,
                                     bytes.size() + 64, huge, huge - 63}) {
    draft.data_offset = offset;
    check_corrupt(draft.build(), "data offset (byte 40)");
  }
}

TEST_CASE("header: a data offset that skips a block of zeros is refused") {
  Draft draft = small_draft();
  const Bytes head = draft.metadata + draft.table;
  draft.table_padding = Bytes(padded(head).size() + 64 - head.size(), '\0');
  check_corrupt(draft.build(), "data offset (byte 40)");
}

TEST_CASE("header: a data offset inside the table is refused") {
  Draft draft;
  draft.table = table_entry("weight.a", 1, {1}, 0) + table_entry("weight.b", 1, {1}, 64);
  draft.tensor_count = 2;
  draft.data = f32_data({1}) + f32_data({2});
  REQUIRE_FALSE(refusal(draft.build()));
  // The same bytes, but the data is said to start where the second entry is not yet complete.
  const Bytes rest = padded(draft.table);
  Draft cut = draft;
  cut.table = rest.substr(0, 64);
  cut.data = rest.substr(64) + draft.data;
  check_corrupt(cut.build(), "tensor \"weight.b\" offset");
}

TEST_CASE("header: a wrong number of data bytes is refused") {
  Draft draft = small_draft();
  const std::uint64_t right = draft.data.size();
  for (const std::uint64_t size : {std::uint64_t{0}, right - 64, right + 64, right - 1, huge}) {
    draft.data_bytes = size;
    check_corrupt(draft.build(), "data bytes (byte 48)");
  }
}

TEST_CASE("header: data that belongs to no tensor is refused") {
  Draft draft = small_draft();
  draft.data += Bytes(64, '\0');
  check_corrupt(draft.build(), "data bytes (byte 48)");
}

TEST_CASE("header: bytes after the data are refused even where the file size counts them") {
  Draft draft = small_draft();
  draft.data_bytes = draft.data.size();
  draft.data += Bytes(64, '\0');
  check_corrupt(draft.build(), "data bytes (byte 48)");
}

TEST_CASE("header: a data section that is no multiple of 64 is refused") {
  Draft draft = small_draft();
  draft.data.resize(128 + 72);  // cut behind the last element, before its padding
  check_corrupt(draft.build(), "tensor \"c\" padded size");
}

TEST_CASE("header: a file without metadata and tensors is valid and empty") {
  const Parsed parsed = parse(Draft{}.build());
  CHECK(parsed.buffer.span().size() == 64);
  CHECK(parsed.file.metadata().empty());
  CHECK(parsed.file.tensors().empty());
}

}  // namespace
}  // namespace vnreg::model_format::test
