#include <dlfcn.h>
#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "cases/hints.hpp"
#include "mpm/external/law.hpp"
#include "mpm/external/shared_library.hpp"

namespace grainpair {
namespace {

/// What the loader says, and what it means.
std::string reason(const std::string& said) {
  const bool lacks = said.find("undefined symbol") != std::string::npos;
  return lacks ? said + "; link what it calls into it (-lgfortran of Fortran)" : said;
}

/// Why a file must not be loaded; empty where it may.
std::string fault(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::string found = fault_of_library(bytes);
  return found.empty() ? fault_of_loading(path) : found;
}

}  // namespace

Library::Library(const Case& scene, std::initializer_list<const char*> usual_names) {
  const std::string &path = scene.word("material.library"),
                    &where = scene.where("material.library");
  if (const std::string found = fault(path); !found.empty())
    refuse(where, "{} cannot be loaded ({})", path, found);
  handle_ = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle_) refuse(where, "{} cannot be loaded ({})", path, reason(dlerror()));
  if (scene.has("material.symbol")) {
    const std::string& name = scene.word("material.symbol");
    symbol_ = dlsym(handle_, name.c_str());
    if (!symbol_)
      refuse(scene.where("material.symbol"),
             "{} has no function '{}' (nm -D {} lists those it has)", path, name, path);
    return;
  }
  for (const char* name : usual_names)
    if (!symbol_) symbol_ = dlsym(handle_, name);
  if (!symbol_)
    refuse(
        where,
        "{} has no function '{}' (of material.interface = \"{}\"; nm -D lists those it has). Name "
        "yours as material.symbol.",
        path, fmt::join(usual_names, "' or '"), scene.word("material.interface"));
}

Library::~Library() {
  if (handle_) dlclose(handle_);
}

void* Library::other(const char* name) const { return dlsym(handle_, name); }

std::unique_ptr<ExternalLaw> make_external_law(const Case& scene) {
  const std::string& interface = scene.word("material.interface");
  return interface == "umat"  ? make_umat(scene)
         : interface == "esm" ? make_esm(scene)
                              : make_block_law(scene);
}

}  // namespace grainpair
