#include "cases/file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <tuple>

#include "cases/hints.hpp"

namespace grainpair {

std::string Source::at(const toml::node& node) const {
  return has_lines ? fmt::format("{}:{}", name, node.source().begin.line) : name;
}

std::string input_file(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code unknown;  // then it is no folder
  return fs::is_directory(path, unknown) ? (fs::path(path) / "case.toml").string() : path;
}

std::string read_text(const std::string& path, const std::string& holds) {
  constexpr std::size_t limit = 1 << 20;
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  // To open a pipe is to wait for its writer, and some devices never end.
  if (std::filesystem::is_other(status))
    refuse(path, "is not a case file (a pipe, socket or device)");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string text;
  std::array<char, 1 << 14> piece;
  while (file && text.size() <= limit) {
    file.read(piece.data(), piece.size());
    text.append(piece.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad() || !file.is_open() || errno == EISDIR)
    refuse(path, "cannot be read ({})", errno ? std::strerror(errno) : "unknown reason");
  if (text.empty()) refuse(path, "is empty (a file of this kind holds at least {})", holds);
  if (text.find('\0') != std::string::npos)
    refuse(path, "is not a case file (binary data, not text)");
  if (text.size() > limit) refuse(path, "is not a case file (longer than 1 MiB)");
  return text;
}

std::optional<std::size_t> too_deep(const std::string& text) {
  constexpr int most = 32;  // brackets in brackets, or words of one dotted key
  std::size_t line = 1;
  int brackets = 0, dots = 0;
  std::string_view quote;  // what ends the string that the place is in
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::string_view rest = std::string_view(text).substr(i);
    if (rest.front() == '\n') {
      ++line, dots = 0;
      if (quote.size() == 1) quote = {};
    }
    if (!quote.empty()) {
      if (quote.front() == '"' && rest.front() == '\\')
        ++i;
      else if (rest.starts_with(quote))
        i += quote.size() - 1, quote = {};
      continue;
    }
    for (const char* opening : {"\"\"\"", "\'\'\'", "\"", "\'"})
      if (quote.empty() && rest.starts_with(opening)) quote = opening;
    if (!quote.empty()) {
      i += quote.size() - 1;
      continue;
    }
    switch (rest.front()) {
      case '#':
        i = std::min(text.find('\n', i), text.size()) - 1;
        break;
      case '.':
        ++dots;
        break;
      case '[':
      case '{':
        ++brackets, dots = 0;
        break;
      case ']':
      case '}':
        --brackets;
        [[fallthrough]];
      case ',':
      case '=':
        dots = 0;
        break;
      default:
        break;
    }
    if (brackets > most || dots > most) return line;
  }
  return std::nullopt;
}

toml::table parse_toml(const std::string& text, const std::string& path) {
  if (const auto line = too_deep(text))
    refuse(fmt::format("{}:{}", path, *line),
           "tables or lists lie more than 32 deep in each other (no key is that deep)");
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    refuse(fmt::format("{}:{}", path, error.source().begin.line), "not valid TOML ({})",
           error.description());
  }
}

std::vector<std::pair<std::string, const toml::node*>> in_order(const toml::table& table) {
  std::vector<std::tuple<toml::source_index, toml::source_index, std::string, const toml::node*>>
      placed;
  placed.reserve(table.size());
  for (const auto& [key, node] : table)
    placed.emplace_back(key.source().begin.line, key.source().begin.column, std::string(key.str()),
                        &node);
  std::ranges::sort(placed);
  std::vector<std::pair<std::string, const toml::node*>> ordered;
  ordered.reserve(placed.size());
  for (auto& [line, column, key, node] : placed) ordered.emplace_back(std::move(key), node);
  return ordered;
}

std::string kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return node.as_array()->empty() ? "an empty array" : "an array";
    case toml::node_type::string:
      return fmt::format("the string \"{}\"", **node.as_string());
    case toml::node_type::integer:
      return fmt::format("the integer {}", **node.as_integer());
    case toml::node_type::floating_point:
      return fmt::format("the real number {}", **node.as_floating_point());
    case toml::node_type::boolean:
      return **node.as_boolean() ? "true" : "false";
    default:
      return "a date or time";
  }
}

}  // namespace grainpair
