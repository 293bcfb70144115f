// Watches the memory that a reader asks for, to prove that it does not believe a malicious size.
#pragma once

#include <cstddef>

namespace vnreg::test {

/// The largest single request to operator new since the construction, in bytes.
class AllocationWatch {
 public:
  AllocationWatch();
  std::size_t largest() const;
};

}  // namespace vnreg::test
