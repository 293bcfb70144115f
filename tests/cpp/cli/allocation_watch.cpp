#include "allocation_watch.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<std::size_t> largest_request{0};
}  // namespace

// All forms for single objects, so that none of a sanitizer's own meets one of these.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  largest_request = std::max(largest_request.load(), size);
  return std::malloc(std::max<std::size_t>(size, 1));
}

void* operator new(std::size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}

void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }

namespace vnreg::test {

AllocationWatch::AllocationWatch() { largest_request = 0; }

std::size_t AllocationWatch::largest() const { return largest_request; }

}  // namespace vnreg::test
