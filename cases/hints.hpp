// How input is refused: the one line, and what may have been meant.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "cases/failure.hpp"
#include "cases/schema.hpp"

namespace grainpair {

/// Throws CaseError with `where: what` on one line, whatever characters the user wrote.
[[noreturn]] void refuse_line(const std::string& where, const std::string& what);

template <class... Args>
[[noreturn]] void refuse(const std::string& where, fmt::format_string<Args...> what,
                         Args&&... args) {
  refuse_line(where, fmt::format(what, std::forward<Args>(args)...));
}

/// " Did you mean 'friction'?" if a known word is near enough for a slip of the keyboard, else "".
std::string suggestion(const std::string& word, const std::vector<std::string>& known);

/// Refuses the key `name` (of a table where it ends in a dot), which is none of `keys`; `prefix`:
/// what its table is called, as "frontier.series.".
[[noreturn]] void refuse_key(const std::vector<Key>& keys, const std::string& where,
                             const std::string& prefix, const std::string& name);

}  // namespace grainpair
