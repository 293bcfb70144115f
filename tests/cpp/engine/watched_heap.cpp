// Replaces malloc and its kin, which lie below operator new and Eigen.
#include "watched_heap.hpp"

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);
}

namespace {

std::atomic<long> allocation_count{0};
std::atomic<long> live_count{0};
std::atomic<long> until_failure{-1};

bool fails() {
  ++allocation_count;
  return until_failure.load() >= 0 && until_failure.fetch_sub(1) == 0;
}

void* counted(void* block) {
  if (block != nullptr) ++live_count;
  return block;
}

}  // namespace

namespace vnreg::test::heap {

long allocations() { return allocation_count; }
long live() { return live_count; }
void fail_after(long count) { until_failure = count; }

}  // namespace vnreg::test::heap

extern "C" {
void* malloc(std::size_t size) { return fails() ? nullptr : counted(__libc_malloc(size)); }
void* calloc(std::size_t count, std::size_t size) {
  return fails() ? nullptr : counted(__libc_calloc(count, size));
}
void* realloc(void* old, std::size_t size) {
  if (fails()) return nullptr;
  if (old != nullptr) --live_count;
  return counted(__libc_realloc(old, size));
}
void* memalign(std::size_t alignment, std::size_t size) {
  return fails() ? nullptr : counted(__libc_memalign(alignment, size));
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  *out = memalign(alignment, size);
  return *out == nullptr ? ENOMEM : 0;
}
void free(void* block) {
  if (block != nullptr) --live_count;
  __libc_free(block);
}
}
