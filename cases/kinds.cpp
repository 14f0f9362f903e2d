#include "cases/kinds.hpp"

#include "cases/check.hpp"
#include "cases/together.hpp"

namespace grainpair {
namespace {

const char* least_of(Kind kind) {
  return kind == Kind::element ? "element, grains and the test's own table"
         : kind == Kind::point ? "case, [start] and a [[leg]]"
                               : "one of the studies' tables";
}

}  // namespace

Document read_document(const std::string& path, Kind kind) {
  Document document;
  document.path = input_file(path);
  document.text = read_text(document.path, least_of(kind));
  GivenValues given;
  const std::vector<Key>& keys = schema(kind);
  take(keys, parse_toml(document.text, document.path), {document.path}, "", given);
  document.values = complete(keys, given, document.path, "");
  if (kind == Kind::point) check_point(document.values);
  return document;
}

}  // namespace grainpair
