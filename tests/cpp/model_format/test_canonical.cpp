// One content has one encoding: whatever the reader accepts, the builder writes again byte by byte.
#include <random>

#include "refusals.hpp"

namespace vnreg::model_format::test {
namespace {

Bytes encoded(const std::string& key, const Value& value) {
  if (const auto* number = std::get_if<std::uint64_t>(&value)) return u64_entry(key, *number);
  if (const auto* number = std::get_if<double>(&value)) return f64_entry(key, *number);
  if (const auto* flag = std::get_if<bool>(&value)) return bool_entry(key, *flag ? 1 : 0);
  return string_entry(key, std::get<std::string>(value));
}

Draft draft_of(const ModelFile& file) {
  Draft draft;
  for (const auto& [key, value] : file.metadata()) draft.metadata += encoded(key, value);
  for (const auto& [name, tensor] : file.tensors()) {
    const std::vector<std::uint64_t> shape(tensor.shape.begin(), tensor.shape.end());
    draft.table +=
        table_entry(name, static_cast<std::uint32_t>(tensor.dtype), shape, draft.data.size());
    draft.data += padded({reinterpret_cast<const char*>(tensor.bytes.data()), tensor.bytes.size()});
    ++draft.tensor_count;
  }
  return draft;
}

// Writes the checksums that the damaged bytes ask for, where its data offset allows.
void repair_checksums(Bytes& bytes) {
  std::uint64_t offset = 0;
  std::memcpy(&offset, bytes.data() + 40, sizeof offset);
  if (offset < 64 || offset > bytes.size()) return;
  bytes.replace(56, 4, u32(bitwise_crc32c(std::string_view(bytes).substr(offset))));
  const Bytes head = bytes.substr(0, 60) + bytes.substr(64, offset - 64);
  bytes.replace(60, 4, u32(bitwise_crc32c(head)));
}

// Whether the damaged bytes are accepted; checks that they are then canonical.
bool accepted_and_canonical(const Bytes& bytes) {
  std::optional<Parsed> parsed;
  try {
    parsed.emplace(parse(bytes));
  } catch (const Error&) {
    return false;
  }
  Draft draft = draft_of(parsed->file);
  std::memcpy(&draft.minor, bytes.data() + 12, sizeof draft.minor);
  if (draft.build() != bytes) FAIL("an accepted file is not written again as it was");
  return true;
}

TEST_CASE("canonical: every changed byte under repaired checksums is refused or means something") {
  const Bytes bytes = small_draft().build();
  std::size_t accepted = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (int pattern = 1; pattern < 256; pattern += 2) {
      Bytes damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ pattern);
      repair_checksums(damaged);
      accepted += accepted_and_canonical(damaged) ? 1 : 0;
    }
  }
  CHECK(accepted > 1000);  // values, letters of names, the minor version
}

TEST_CASE("canonical: random splices under repaired checksums never break the reader") {
  const Bytes bytes = small_draft().build();
  std::mt19937 generator(20230529);
  const auto below = [&](std::size_t bound) { return generator() % bound; };
  for (int round = 0; round < 20000; ++round) {
    Bytes damaged = bytes;
    for (std::size_t edits = 1 + below(4); edits > 0; --edits) {
      const std::size_t size = 1 + below(8);
      const std::size_t to = 8 + below(bytes.size() - 8 - size);
      const Bytes piece = below(3) == 0 ? Bytes(size, below(2) == 0 ? '\0' : '\xff')
                                        : bytes.substr(below(bytes.size() - size), size);
      damaged.replace(to, size, piece);
    }
    repair_checksums(damaged);
    accepted_and_canonical(damaged);
  }
  SUCCEED();
}

}  // namespace
}  // namespace vnreg::model_format::test
