#include "cases/case.hpp"

#include <algorithm>
#include <filesystem>
#include <set>

#include "cases/check.hpp"
#include "cases/hints.hpp"
#include "cases/together.hpp"

namespace grainpair {
namespace {

namespace fs = std::filesystem;

constexpr const char* least = "geometry, grains, initial, material, mpm";

/// The file of a material card: a path that ends in .toml, or a name looked up in the `materials`
/// folder beside the case file or beside a folder above it.
fs::path find_card(const Given& card) {
  const std::string name = std::get<std::string>(card.value);
  if (name.ends_with(".toml")) return (card.folder / name).lexically_normal();
  const fs::path start = card.folder.empty() ? fs::path(".") : card.folder;
  for (fs::path folder = fs::absolute(start).lexically_normal();; folder = folder.parent_path()) {
    for (const char* place : {"materials", "cases/materials"})
      if (const fs::path file = folder / place / (name + ".toml"); fs::exists(file))
        return file.lexically_proximate(fs::current_path());
    if (folder == folder.root_path()) break;
  }
  refuse(card.where, "no material card '{0}' (no materials/{0}.toml beside {1} or above it). {2}",
         name, start.string(), "A card elsewhere is named by its path, ending in .toml.");
}

void take_card(GivenValues& given) {
  const auto card = given.find("material.card");
  if (card == given.end() || std::get<std::string>(card->second.value).empty()) return;
  const bool silent = std::ranges::any_of(schema(), [&](const Key& key) {
    return key.table() == "material" && !given.contains(key.name);
  });
  if (!silent) return;
  const std::string path = find_card(card->second).string();
  const toml::table table = parse_toml(read_text(path, "[material]"), path);
  const Source source{path};
  for (const auto& [name, node] : in_order(table))
    if (name != "material")
      refuse(source.at(*node),
             "'{}' does not belong in a material card (it holds a [material] table alone)", name);
  take(schema(), table, source, "", given);
}

}  // namespace

Case Case::load(const std::string& path, const std::vector<std::string>& overrides) {
  Case result;
  result.path_ = fs::is_directory(path) ? (fs::path(path) / "case.toml").string() : path;

  GivenValues given;
  for (const auto& assignment : overrides) {
    const std::string where = "--set " + assignment;
    auto [key, value] = check_assignment(assignment, where);
    given.insert_or_assign(key, Given{std::move(value), where, fs::path()});
  }

  std::set<fs::path> seen;
  for (std::string file = result.path_; !file.empty();) {
    const std::string text = read_text(file, least);
    if (result.text_.empty()) result.text_ = text;
    seen.insert(fs::weakly_canonical(file));
    const toml::table table = parse_toml(text, file);
    const Source source{file};
    if (const auto* element = table.get("element"))
      refuse(source.at(*element),
             "this is an element test, not a scene (no column). Run it with: grainpair element");
    take(schema(), table, source, "", given);

    const auto extends = given.extract("extends");
    file.clear();
    if (!extends || std::get<std::string>(extends.mapped().value).empty()) continue;
    const Given& base = extends.mapped();
    file = (base.folder / std::get<std::string>(base.value)).lexically_normal().string();
    if (seen.contains(fs::weakly_canonical(file)))
      refuse(base.where, "extends '{}', which extends this file in turn (a circle has no end)",
             file);
    if (!fs::exists(file)) refuse(base.where, "extends '{}', which does not exist", file);
  }
  take_card(given);
  result.values_ = complete(schema(), given, result.path_, "");
  check_scene(result.values_);
  return result;
}

}  // namespace grainpair
