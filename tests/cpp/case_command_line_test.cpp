// The command line: what is bound, what is refused, and the exit codes of both.
#include <gtest/gtest.h>

#include "cases/command_line.hpp"

namespace grainpair {
namespace {

struct Values {
  std::string file, word = "as it was";
  std::vector<std::string> sets;
  std::vector<double> range;
  int threads = 1, cores = 1;
  unsigned seed = 1;
  bool quiet = false;
};

std::optional<int> parse(Values& v, std::vector<std::string> words) {
  CommandLine line("Does nothing.");
  line.option("file", v.file, "a file")
      .required()
      .option("--word", v.word, "one of two")
      .one_of({"mirror", "open"})
      .repeated("--set", v.sets, "key=value")
      .option("--range", v.range, "two numbers")
      .count(2)
      .option("--threads", v.threads, "how many")
      .positive()
      .option("--cores", v.cores, "how many at once")
      .threads()
      .option("--seed", v.seed, "of random numbers")
      .seed()
      .flag("--quiet", v.quiet, "says nothing");
  words.insert(words.begin(), "program");
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  return line.parse(static_cast<int>(argv.size()), argv.data());
}

TEST(CommandLine, BindsWhatItIsGivenAndKeepsTheRest) {
  Values v;
  EXPECT_EQ(parse(v, {"--set", "a=1", "here", "--set", "b=2", "--range", "0.5", "2", "--quiet",
                      "--threads", "3"}),
            std::nullopt);
  EXPECT_EQ(v.file, "here");
  EXPECT_EQ(v.word, "as it was");
  EXPECT_EQ(v.sets, (std::vector<std::string>{"a=1", "b=2"}));
  EXPECT_EQ(v.range, (std::vector<double>{0.5, 2.0}));
  EXPECT_EQ(v.threads, 3);
  EXPECT_TRUE(v.quiet);
}

TEST(CommandLine, AMistakeEndsTheProgramWithTwo) {
  Values v;
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{},
                                             {"here", "--threads", "0"},
                                             {"here", "--threads", "two"},
                                             {"here", "--threads", "3x"},
                                             {"here", "--word", "shut"},
                                             {"here", "--range", "1"},
                                             {"here", "there"},
                                             {"here", "--sett", "a=1"}})
    EXPECT_EQ(parse(v, words), 2) << (words.empty() ? "nothing" : words.back());
}

TEST(CommandLine, CountsHaveBoundsAndAMistakeIsOneLine) {
  Values v;
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"here", "--cores", "0"},
                                             {"here", "--cores", "-1"},
                                             {"here", "--cores", "1025"},
                                             {"here", "--seed", "-1"},
                                             {"here", "--seed", "4294967296"},
                                             {"here", "--seed", "99999999999999999999"}}) {
    ::testing::internal::CaptureStderr();
    EXPECT_EQ(parse(v, words), 2);
    const std::string line = ::testing::internal::GetCapturedStderr();
    EXPECT_NE(line.find(words[1] + ": " + words[2] + " is no whole number from "),
              std::string::npos);
    EXPECT_EQ(std::ranges::count(line, '\n'), 1);
  }
  EXPECT_EQ(parse(v, {"here", "--cores", "1024", "--seed", "4294967295"}), std::nullopt);
  EXPECT_EQ(v.cores, 1024);
  EXPECT_EQ(v.seed, 4294967295u);
}

TEST(CommandLine, HelpEndsTheProgramWell) {
  Values v;
  EXPECT_EQ(parse(v, {"--help"}), 0);
}

}  // namespace
}  // namespace grainpair
