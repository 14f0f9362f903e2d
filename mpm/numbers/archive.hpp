// What a run goes on from: every number that lasts from step to step is named once, for the way
// into a checkpoint and for the way back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace grainpair {

/// Keeps numbers under names, or puts back what is kept.
class Archive {
 public:
  enum class Type { f64, f32, i64, u64, i32, u32 };
  virtual ~Archive() = default;

  template <class T>
  void number(const std::string& name, T& value) {
    numbers(name, std::span(&value, 1));
  }
  template <class T>
  void numbers(const std::string& name, std::span<T> values) {
    pass(name, type_of<T>(), values.data(), values.size());
  }
  /// A list comes back as long as it was.
  template <class T, class Allocator>
  void list(const std::string& name, std::vector<T, Allocator>& values) {
    values.resize(length(name, values.size()));
    numbers(name, std::span(values));
  }
  /// A list of structs that hold `Number`s alone, or one such struct.
  template <class Number, class T>
  void structs(const std::string& name, std::vector<T>& values) {
    constexpr std::size_t width = width_of<Number, T>;
    values.resize(length(name, width * values.size()) / width);
    numbers(name, numbers_of<Number>(std::span(values)));
  }
  template <class Number, class T>
  void structure(const std::string& name, T& value) {
    numbers(name, numbers_of<Number>(std::span(&value, 1)));
  }

 protected:
  /// Of a list that has `now` numbers: how many it shall have.
  virtual std::size_t length(const std::string& name, std::size_t now) = 0;
  virtual void pass(const std::string& name, Type type, void* values, std::size_t count) = 0;

 private:
  template <class Number, class T>
  static constexpr std::size_t width_of = [] {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(Number) == 0);
    return sizeof(T) / sizeof(Number);
  }();
  template <class Number, class T>
  static std::span<Number> numbers_of(std::span<T> values) {
    return {reinterpret_cast<Number*>(values.data()), values.size() * width_of<Number, T>};
  }
  template <class T>
  static constexpr Type type_of() {
    if constexpr (std::is_same_v<T, double>) return Type::f64;
    if constexpr (std::is_same_v<T, float>) return Type::f32;
    if constexpr (std::is_integral_v<T>) {
      constexpr bool is_long = sizeof(T) == 8;
      static_assert(is_long || sizeof(T) == 4);
      if constexpr (std::is_signed_v<T>) return is_long ? Type::i64 : Type::i32;
      return is_long ? Type::u64 : Type::u32;
    }
  }
};

}  // namespace grainpair
