// A digest of bytes: whether they are the same as before, not whether somebody meant them to seem
// so.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace grainpair {

/// FNV-1a of all bytes given so far, in 16 hexadecimal digits.
class Digest {
 public:
  Digest& add(std::string_view bytes) {
    for (const char c : bytes) hash_ = (hash_ ^ static_cast<unsigned char>(c)) * 1099511628211u;
    return *this;
  }
  std::string text() const { return fmt::format("{:016x}", hash_); }

 private:
  std::uint64_t hash_ = 14695981039346656037u;
};

}  // namespace grainpair
