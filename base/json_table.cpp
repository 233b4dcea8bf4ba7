// SPDX-License-Identifier: MIT
#include "base/json_table.hpp"

namespace prism {

Json schema_of_file(const std::string& program, const std::string& source, const Json& object) {
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"$comment", "SPDX-License-Identifier: MIT. For editors; written from " + source + " by its test."},
                 {"title", program + " configuration"}};
  schema.update(object);
  return schema;
}

Json plain_number(double number) {
  const bool is_integer = std::abs(number) < 1e15 && number == std::round(number);
  return is_integer ? Json(static_cast<std::int64_t>(number)) : Json(number);
}

Json limits_schema(const char* type, Range range) {
  Json json = {{"type", type}};
  if (range.min > kAnyNumber.min) json["minimum"] = plain_number(range.min);
  if (range.max < kAnyNumber.max) json["maximum"] = plain_number(range.max);
  return json;
}

Json unsigned_schema() {
  const Json text = {{"type", "string"}, {"pattern", "^(0[xX][0-9a-fA-F]+|[0-9]+)$"}};
  return {{"anyOf", {limits_schema("integer", {0, kAnyNumber.max}), text}}};
}

Json one_or_more_schema(const Json& one, int least) {
  Json several = {{"type", "array"}, {"items", one}};
  if (least > 0) several["minItems"] = least;
  return {{"anyOf", {one, several}}};
}

}  // namespace prism
