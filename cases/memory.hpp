// Memory that this process may still take.
#pragma once

#include <cstdint>

namespace grainpair {

/// What the kernel can give without swapping, or what the control group still allows where that is
/// less [bytes]. cases/memory.py asks the same.
std::uint64_t available_memory();

}  // namespace grainpair
