// SPDX-License-Identifier: MIT
// frame.schema.json (for editors) and the reader agree on keys and types. The reader also checks references, overlaps
// and speeds, so it may reject more.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <sstream>

#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "tests/support/schema_validator.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

Json load(const std::filesystem::path& path) { return Json::parse(test::read_file(path), nullptr, true, true); }

/// With one test vector only: they are all alike, and each change costs a run of both readers.
Json load_short(const std::string& name) {
  Json description = load(test::frames_dir() / (name + ".json"));
  if (description.contains("vectors")) description["vectors"].get_ref<Json::array_t&>().resize(1);
  return description;
}

Json schema() { return load(test::frames_dir() / "frame.schema.json"); }

std::vector<std::pair<std::string, Json>> shipped_json() {
  std::vector<std::pair<std::string, Json>> all;
  for (const auto& entry : std::filesystem::directory_iterator(test::frames_dir())) {
    if (entry.path().extension() == ".json" && entry.path().stem() != "frame.schema")
      all.emplace_back(entry.path().stem(), load(entry.path()));
  }
  return all;
}

bool reader_accepts(const Json& description) { return parse_frame_description(description.dump(), "x").has_value(); }

/// Calls visit(pointer) for every object at `steps` from `at`: '*' is any member, and an array means its elements.
void find_objects(const Json& root, const Json::json_pointer& at, std::span<const std::string> steps,
                  const std::function<void(const Json::json_pointer&)>& visit) {
  const Json& json = root.at(at);
  if (json.is_array()) {
    for (std::size_t i = 0; i < json.size(); ++i) find_objects(root, at / i, steps, visit);
  } else if (json.is_object() && steps.empty()) {
    visit(at);
  } else if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      if (steps[0] == "*" || steps[0] == key) find_objects(root, at / key, steps.subspan(1), visit);
    }
  }
}

/// The keys that the reader expects instead of an unknown one.
std::set<std::string> keys_of_reader(Json description, const Json::json_pointer& at) {
  description[at]["zz_none"] = 0;
  const auto parsed = parse_frame_description(description.dump(), "x");
  const std::string text = parsed ? "accepted" : parsed.error().what;
  const std::string opening = "expected one of ";
  std::set<std::string> keys;
  if (text.find(opening) == std::string::npos) return {text};
  std::istringstream list(text.substr(text.find(opening) + opening.size()));
  for (std::string key; list >> key;) keys.insert(key.substr(0, key.find(',')));
  return keys;
}

/// Positions of the schema's definitions in a description.
const std::map<std::string, std::vector<std::string>> kSections = {
    {"description", {}},
    {"line", {"line"}},
    {"part", {"parts", "*"}},
    {"kind", {"kinds"}},
    {"sync", {"kinds", "sync"}},
    {"length", {"kinds", "length"}},
    {"body", {"kinds", "body"}},
    {"refuse", {"kinds", "refuse"}},
    {"check", {"kinds", "checks"}},
    {"text", {"kinds", "text"}},
    {"items", {"kinds", "items"}},
    {"blocks", {"kinds", "blocks"}},
    {"layout", {"kinds", "layout"}},
    {"field", {"kinds", "fields", "*"}},
    {"when", {"kinds", "fields", "*", "when"}},
    {"convert", {"kinds", "fields", "*", "convert"}},
    {"gyro", {"gyro"}},
    {"axis", {"gyro", "axes", "*"}},
    {"valid", {"gyro", "valid"}},
    {"counter", {"counter"}},
    {"channel", {"temperature"}},
    {"sensor", {"sensors", "*"}},
    {"role", {"status"}},
    {"vector", {"vectors"}},
    {"command", {"start"}},
    {"poll", {"poll"}},
    {"request", {"poll", "requests"}},
};

TEST(Schema, HasTheKeysOfTheReaderAndNoOthers) {
  const Json whole = schema();
  for (const auto& [section, steps] : kSections) {
    const Json& object = section == "description" ? whole : whole.at("definitions").at(section);
    std::set<std::string> written;
    for (const auto& [key, value] : object.at("properties").items()) written.insert(key);
    int places = 0;
    for (const auto& [name, description] : shipped_json()) {
      int here = 0;  // a few of each description: they are all alike
      find_objects(description, Json::json_pointer(), steps,
                   [&, &within = section, &file = name, &text = description](const Json::json_pointer& at) {
                     if (++here > 4) return;
                     ++places;
                     EXPECT_EQ(written, keys_of_reader(text, at)) << within << ": " << file << at.to_string();
                   });
    }
    EXPECT_GT(places, 0) << section;
  }
  for (const auto& [name, definition] : whole.at("definitions").items()) {
    EXPECT_TRUE(!definition.contains("properties") || kSections.contains(name))
        << name << " is not a section of the reader";
  }
}

TEST(Schema, AcceptsEveryShippedDescription) {
  const test::SchemaValidator validator(schema());
  for (const auto& [name, description] : shipped_json()) EXPECT_TRUE(validator.accepts(description)) << name;
}

/// Calls visit(pointer) for every value of a document.
void walk(const Json& json, const Json::json_pointer& at, const std::function<void(const Json::json_pointer&)>& visit) {
  if (!at.empty()) visit(at);
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) walk(value, at / key, visit);
  } else if (json.is_array()) {
    for (std::size_t i = 0; i < json.size(); ++i) walk(json[i], at / i, visit);
  }
}

std::vector<Json> wrong_values() { return {nullptr, -1, 3, 1e12, "", "0x7", Json::array({1, 2}), Json{{"what", 1}}}; }

// Replaces each value of a description by values of every type. If the schema rejects the result, so does the reader;
// if the reader accepts it, so does the schema.
TEST(Schema, AcceptsEveryFormThatTheReaderAccepts) {
  const test::SchemaValidator validator(schema());
  int refused_by_both = 0;
  for (const char* name : {"trplg", "fizoptika", "microstrain-mip", "ixblue-phins-nmea"}) {
    const Json original = load_short(name);
    ASSERT_TRUE(reader_accepts(original));
    walk(original, Json::json_pointer(), [&](const Json::json_pointer& at) {
      for (const Json& wrong : wrong_values()) {
        Json changed = original;
        changed[at] = wrong;
        const bool read = reader_accepts(changed);
        const bool formed = validator.accepts(changed);
        EXPECT_FALSE(read && !formed) << name << at.to_string() << " = " << wrong.dump()
                                      << ": only the schema refuses it";
        refused_by_both += !read && !formed ? 1 : 0;
      }
    });
  }
  EXPECT_GT(refused_by_both, 1500);
}

// The reader may reject what the schema accepts, but not for a key or a type: those belong in the schema.
TEST(Schema, RejectsTheTypesAndKeysThatTheReaderRejects) {
  const test::SchemaValidator validator(schema());
  for (const char* name : {"trplg", "fizoptika", "microstrain-mip", "dsp3000-ascii"}) {
    const Json original = load_short(name);
    walk(original, Json::json_pointer(), [&](const Json::json_pointer& at) {
      for (const Json& wrong : {Json(nullptr), Json(true), Json::object({{"what", 1}})}) {
        if (original.at(at).type() == wrong.type()) continue;
        Json changed = original;
        changed[at] = wrong;
        EXPECT_FALSE(validator.accepts(changed)) << name << at.to_string() << " = " << wrong.dump();
        EXPECT_FALSE(reader_accepts(changed)) << name << at.to_string() << " = " << wrong.dump();
      }
    });
  }
}

}  // namespace
}  // namespace prism::wire
