#include "colmap_ext/json_file.h"

#include "phi/base/error.h"

namespace colmap_ext {
namespace {

using Json = nlohmann::ordered_json;

template <typename Input>
Json Parse(Input& input) {
  constexpr int kMaxDepth = 64;
  return Json::parse(input, [](int depth, Json::parse_event_t, Json&) {
    if (depth > kMaxDepth) throw phi::InputError("it is nested more than 64 levels deep");
    return true;
  });
}

template <typename AnyJson>
std::string Dump(const AnyJson& json, int indent) {
  return json.dump(indent, ' ', false, AnyJson::error_handler_t::replace);
}

}  // namespace

Json ParseJson(std::istream& input) { return Parse(input); }
Json ParseJson(const std::string& text) { return Parse(text); }

std::string DumpJson(const Json& json, int indent) { return Dump(json, indent); }
std::string DumpJson(const nlohmann::json& json, int indent) { return Dump(json, indent); }

bool IsUtf8(const std::string& text) {
  try {
    Json(text).dump();
    return true;
  } catch (const Json::type_error&) {
    return false;
  }
}

}  // namespace colmap_ext
