// Input files that a test writes, and how they are refused.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "cases/failure.hpp"

namespace grainpair::test {

/// A folder of files that goes when the test ends.
class Files : public ::testing::Test {
 protected:
  Files() : folder_(std::filesystem::path(::testing::TempDir()) / "grainpair" / name()) {
    std::filesystem::create_directories(folder_);
  }
  ~Files() override { std::filesystem::remove_all(folder_); }

  std::string file(const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }

  std::filesystem::path folder_;

 private:
  /// Of the suite and the test, apart for each: tests run side by side.
  static std::string name() {
    const auto& test = *::testing::UnitTest::GetInstance()->current_test_info();
    return std::string(test.test_suite_name()) + "/" + test.name();
  }
};

/// The line with which the reading is refused.
template <class Reading>
std::string refusal(const Reading& read) {
  try {
    read();
  } catch (const CaseError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace grainpair::test
