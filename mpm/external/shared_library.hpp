// What is asked of a file before the system's loader has it: that it is a shared library for this
// machine, whole, and that loading it ends well. The loader itself believes what a file says, and
// crashes over one that is cut short.
#pragma once

#include <string>
#include <string_view>

namespace grainpair {

/// Why these bytes are no shared library that this machine can load; empty where they are one.
/// Sound are the tables that the loader reads; what it executes is the library's own.
std::string fault_of_library(std::string_view bytes);

/// Loads a library in a child process. Why that ends badly (a crash, an exit, more than `seconds`);
/// empty where it does not, or where the loader itself says what is wrong.
std::string fault_of_loading(const std::string& path, unsigned seconds = 60);

}  // namespace grainpair
