#include "cases/command_line.hpp"

#include <CLI/CLI.hpp>

namespace grainpair {

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
  parser_->last->check(CLI::Range(low, high));
  return *this;
}
CommandLine& CommandLine::positive() {
  parser_->last->check(CLI::PositiveNumber);
  return *this;
}
CommandLine& CommandLine::count(int values) {
  parser_->last->expected(values);
  return *this;
}

template <class Value>
CommandLine& CommandLine::option(const std::string& names, Value& value, const std::string& doc) {
  parser_->last = parser_->app.add_option(names, value, doc);
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
  parser_->last = parser_->app.add_option(names, values, doc)->take_all()->expected(1);
  return *this;
}

CommandLine& CommandLine::flag(const std::string& names, bool& value, const std::string& doc) {
  parser_->last = parser_->app.add_flag(names, value, doc);
  return *this;
}

std::optional<int> CommandLine::parse(int argc, char** argv) {
  try {
    parser_->app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return parser_->app.exit(error) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

}  // namespace grainpair
