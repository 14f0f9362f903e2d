#include "cases/case.hpp"

#include <algorithm>
#include <filesystem>
#include <set>

#include "cases/check.hpp"
#include "cases/constants.hpp"
#include "cases/hints.hpp"
#include "cases/library.hpp"
#include "cases/together.hpp"

namespace grainpair {

extern const char* const cards_folder;  // of this clone

namespace {

namespace fs = std::filesystem;

constexpr const char* least = "geometry, grains, initial, material, mpm";

bool there(const fs::path& file) {
  std::error_code unknown;
  return fs::exists(file, unknown);
}

/// One name of a file, whatever links lead to it; of what has none, such as a pipe, the given one.
fs::path one_name(const fs::path& file) {
  std::error_code error;
  const fs::path name = fs::canonical(file, error);
  return error ? fs::absolute(file, error) : name;
}

/// The file of a material card, a name or a path that ends in .toml: beside the case file, for a
/// name also in the `materials` of its folder or of one above; then among the cards of this clone.
fs::path find_card(const Given& card) {
  const std::string name = std::get<std::string>(card.value);
  const bool named = !name.ends_with(".toml");
  const fs::path file = named ? name + ".toml" : name;
  const fs::path start = card.folder.empty() ? fs::path(".") : card.folder;
  const fs::path own = cards_folder;
  std::vector<fs::path> places{start / file};
  const fs::path top = fs::absolute(start).lexically_normal();
  for (fs::path folder = top; named; folder = folder.parent_path()) {
    places.push_back(folder / "materials" / file);
    places.push_back(folder / "cases" / "materials" / file);
    if (folder == folder.root_path()) break;
  }
  places.push_back(own / file);
  const auto found = std::ranges::find_if(places, there);
  if (found == places.end())
    refuse(card.where, "no material card '{}' (no {} in {}{}, nor in {}). {}", name, file.string(),
           start.string(), named ? ", nor in materials/ there or above" : "", own.string(),
           named ? "A card elsewhere is named by its path, ending in .toml."
                 : "A path starts from the case file, or from the root.");
  return found == places.begin() ? found->lexically_normal()
                                 : found->lexically_proximate(fs::current_path());
}

/// Takes what the case is silent about from its card, where it names one and lacks anything.
Card take_card(GivenValues& given) {
  const auto card = given.find("material.card");
  if (card == given.end() || std::get<std::string>(card->second.value).empty()) return {};
  const bool silent = std::ranges::any_of(schema(), [&](const Key& key) {
    return key.table() == "material" && !given.contains(key.name);
  });
  if (!silent) return {};
  const std::string path = find_card(card->second).string();
  const toml::table table = parse_toml(read_text(path, "[material]"), path);
  const Source source{path};
  for (const auto& [name, node] : in_order(table))
    if (name != "material" && name != "grains")
      refuse(
          source.at(*node),
          "'{}' does not belong in a material card (it holds a [material] table, and in [grains] "
          "what it was fitted to)",
          name);
  Card read{std::get<std::string>(card->second.value), {}, {}};
  take(schema(), table, source, "", read.constants);
  for (const char* key : {"diameter", "density", "young_modulus", "restitution", "friction"}) {
    if (!table.contains("grains")) break;
    auto fitted = read.constants.extract(std::string("grains.") + key);
    if (!fitted)
      refuse(source.at(*table.get("grains")), "missing key 'grains.{}' (of what the card fits)",
             key);
    read.grains.insert(std::move(fitted));
  }
  for (const char* key : {"sizes", "size_spread", "rolling_friction"})  // else equal, and none
    if (auto fitted = read.constants.extract(std::string("grains.") + key))
      read.grains.insert(std::move(fitted));
  std::erase_if(read.constants, [](const auto& one) { return one.first.starts_with("grains."); });
  given.insert(read.constants.begin(), read.constants.end());
  return read;
}

}  // namespace

Case Case::load(const std::string& path, const std::vector<std::string>& overrides) {
  Case result;
  result.path_ = input_file(path);

  GivenValues given;
  for (const auto& assignment : overrides) {
    const std::string where = "--set " + assignment;
    auto [key, value] = check_assignment(assignment, where);
    given.insert_or_assign(key,
                           Given{std::move(value), where, fs::path(result.path_).parent_path()});
  }

  std::set<fs::path> seen;
  for (std::string file = result.path_; !file.empty();) {
    const std::string text = read_text(file, least);
    if (result.text_.empty()) result.text_ = text;
    seen.insert(one_name(file));
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
    if (seen.contains(one_name(file)))
      refuse(base.where, "extends '{}', which extends this file in turn (a circle has no end)",
             file);
    std::error_code error;
    static_cast<void>(fs::canonical(file, error));
    if (error == std::errc::no_such_file_or_directory)
      refuse(base.where, "extends '{}', which does not exist", file);
  }
  const Card card = take_card(given);
  find_library(given, result.path_);
  result.values_ = complete(schema(), given, result.path_, "");
  check_scene(result.values_);
  derive_constants(result.values_);
  result.stiffness_.grains = soften_grains(result.values_);
  result.resolved_ = result.values_.as_toml();
  result.stiffness_.continuum = soften_continuum(result.values_);
  result.contradictions_ = grainpair::contradictions(result.values_, card);
  return result;
}

}  // namespace grainpair
