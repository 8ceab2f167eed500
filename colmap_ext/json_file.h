// JSON that other programs may have written, or that a disk has damaged. Parser and printer are compiled once, in
// json_file.cc: in every file that uses them they would cost seconds.
#pragma once

#include <istream>
#include <string>

#include <nlohmann/json.hpp>

namespace colmap_ext {

// Both throw nlohmann::json::exception where it is no JSON, phi::InputError where it is nested so deeply that no program of
// ours wrote it: copies and output of such values recurse.
nlohmann::ordered_json ParseJson(std::istream& input);
nlohmann::ordered_json ParseJson(const std::string& text);

// With line breaks and `indent` spaces a level, or -1 = in one line. What is not UTF-8 is replaced, so it never throws.
std::string DumpJson(const nlohmann::ordered_json& json, int indent);
std::string DumpJson(const nlohmann::json& json, int indent);

// Whether JSON can hold the text as it is: that of other programs need not be UTF-8.
bool IsUtf8(const std::string& text);

}  // namespace colmap_ext
