// The state of the accounts, to memory and back, so that a run that was stopped goes on with it.
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <vector>

namespace grainpair::ledger {

/// Collects values, or gives them back in the same order: whoever has a state lists what it is made
/// of once, and the list serves both ways.
class State {
 public:
  State() = default;
  /// Gives back what another one has collected.
  explicit State(std::span<const std::byte> from) : left_(from), gives_(true) {}

  bool gives() const { return gives_; }
  const std::vector<std::byte>& collected() const { return collected_; }
  bool ended() const { return left_.empty(); }

  /// Throws std::length_error where less is left to give.
  template <class Value>
  void operator()(Value& value) {
    static_assert(std::is_trivially_copyable_v<Value>);
    bytes(&value, sizeof(Value));
  }
  template <class Value>
  void operator()(std::vector<Value>& values) {
    static_assert(std::is_trivially_copyable_v<Value>);
    std::size_t count = values.size();
    (*this)(count);
    if (gives_ && count > left_.size() / sizeof(Value)) throw std::length_error("no such state");
    values.resize(count);
    bytes(values.data(), count * sizeof(Value));
  }

 private:
  void bytes(void* values, std::size_t count) {
    if (!gives_) {
      const auto* first = static_cast<const std::byte*>(values);
      collected_.insert(collected_.end(), first, first + count);
      return;
    }
    if (count > left_.size()) throw std::length_error("no such state");
    if (count) std::memcpy(values, left_.data(), count);
    left_ = left_.subspan(count);
  }

  std::vector<std::byte> collected_;
  std::span<const std::byte> left_;
  bool gives_ = false;
};

}  // namespace grainpair::ledger
