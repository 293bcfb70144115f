// The heap under watch: every way to it is counted, and may be told to fail once.
#pragma once

namespace vnreg::test::heap {

/// Allocations since the program began.
long allocations();
/// Blocks that were allocated and not given back.
long live();
/// Lets the allocation fail that follows `count` others, and no other. Negative: none.
void fail_after(long count);

}  // namespace vnreg::test::heap
