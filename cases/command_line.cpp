#include "cases/command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <limits>

namespace grainpair {

namespace {

bool read(const std::string& word, std::string& value) {
  value = word;
  return true;
}
template <class Number>
bool read(const std::string& word, Number& value) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}
template <class Value>
bool read(const std::string& word, std::vector<Value>& values) {
  return read(word, values.emplace_back());
}

/// Of whole numbers.
template <class Number>
std::function<std::string(const std::string&)> limited(Number low, Number high) {
  return [=](const std::string& word) {
    Number n = low;
    return read(word, n) && low <= n && n <= high
               ? std::string()
               : fmt::format("{} is no whole number from {} to {}", word, low, high);
  };
}

std::function<std::string(const std::string&)> limited(double low, double high,
                                                       const std::string& where) {
  return [=](const std::string& word) {
    double x = 0.0;
    return read(word, x) && low <= x && x <= high ? std::string()
                                                  : fmt::format("{} is no number {}", word, where);
  };
}

}  // namespace

struct CommandLine::Parser {
  explicit Parser(const std::string& does) : app(does) {}
  CLI::App app;
  CLI::Option* last = nullptr;
};

CommandLine::CommandLine(const std::string& does) : parser_(std::make_unique<Parser>(does)) {}
CommandLine::~CommandLine() = default;

CommandLine& CommandLine::required() {
  parser_->last->required();
  return *this;
}
CommandLine& CommandLine::one_of(const std::vector<std::string>& words) {
  parser_->last->check(CLI::IsMember(words));
  return *this;
}
CommandLine& CommandLine::within(double low, double high) {
  parser_->last->check(limited(low, high, fmt::format("between {} and {}", low, high)));
  return *this;
}
CommandLine& CommandLine::positive() {
  const double least = std::numeric_limits<double>::denorm_min();
  parser_->last->check(limited(least, std::numeric_limits<double>::infinity(), "above 0"));
  return *this;
}
CommandLine& CommandLine::count(int values) {
  parser_->last->expected(values);
  return *this;
}
CommandLine& CommandLine::threads() {
  parser_->last->check(limited<int>(1, most_threads));
  return *this;
}
CommandLine& CommandLine::seed() {
  parser_->last->check(limited<unsigned>(0, most_seed));
  return *this;
}

namespace {

template <class Value>
constexpr bool is_list = false;
template <class Value>
constexpr bool is_list<std::vector<Value>> = true;

}  // namespace

// By a function: of CLI11's own conversions every type would be compiled anew.
template <class Value>
CommandLine& CommandLine::option(const std::string& names, Value& value, const std::string& doc) {
  const CLI::callback_t take = [&value](const CLI::results_t& words) {
    if constexpr (is_list<Value>) value.clear();
    return std::all_of(words.begin(), words.end(),
                       [&](const std::string& word) { return read(word, value); });
  };
  parser_->last = parser_->app.add_option(names, take, doc);
  if constexpr (is_list<Value>)
    parser_->last->expected(1, CLI::detail::expected_max_vector_size)->allow_extra_args();
  return *this;
}
template CommandLine& CommandLine::option(const std::string&, std::string&, const std::string&);
template CommandLine& CommandLine::option(const std::string&, int&, const std::string&);
template CommandLine& CommandLine::option(const std::string&, unsigned&, const std::string&);
template CommandLine& CommandLine::option(const std::string&, double&, const std::string&);
template CommandLine& CommandLine::option(const std::string&, std::vector<std::string>&,
                                          const std::string&);
template CommandLine& CommandLine::option(const std::string&, std::vector<double>&,
                                          const std::string&);
template CommandLine& CommandLine::option(const std::string&, std::vector<std::size_t>&,
                                          const std::string&);

CommandLine& CommandLine::repeated(const std::string& names, std::vector<std::string>& values,
                                   const std::string& doc) {
  option(names, values, doc);
  parser_->last->expected(1)->allow_extra_args(false)->take_all();
  return *this;
}

CommandLine& CommandLine::flag(const std::string& names, bool& value, const std::string& doc) {
  parser_->last = parser_->app.add_flag_callback(
      names, [&value] { value = true; }, doc);
  return *this;
}

std::optional<int> CommandLine::parse(int argc, char** argv) {
  try {
    parser_->app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // for help
    return parser_->app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::string line = fmt::format("{} (see --help)", error.what());
    std::ranges::replace(line, '\n', ' ');
    fmt::print(stderr, "{}: {}\n", std::filesystem::path(argv[0]).filename().string(), line);
    return 2;
  }
  return std::nullopt;
}

}  // namespace grainpair
