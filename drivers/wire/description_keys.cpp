// SPDX-License-Identifier: MIT
// Every key of a frame description, object by object. config/frames/frame.schema.json says the same to editors.
#include <algorithm>
#include <map>

#include "drivers/wire/json_section.hpp"

namespace prism::wire {

namespace {

using Keys = std::map<std::string, std::vector<std::string>, std::less<>>;

const Keys& all_keys() {
  static const Keys kKeys = {
      {"description", {"$schema", "format",         "version",    "name",   "title",   "source", "proved", "line",
                       "rate_hz", "rate_tolerance", "latency_us", "order",  "parts",   "kinds",  "send",   "gyro",
                       "counter", "temperature",    "uhfo",       "status", "latency", "vectors"}},
      {"line", {"baud", "data_bits", "parity", "stop_bits"}},
      {"part", {"size", "fields"}},
      {"kind",
       {"name", "sync", "after", "length", "body", "refuse", "checks", "trailer", "text", "items", "blocks", "layout",
        "fields"}},
      {"sync", {"at", "bytes", "mask"}},
      {"length", {"at", "type", "order", "multiply", "add", "min", "max", "terminator"}},
      {"body", {"from", "to", "mask", "value"}},
      {"refuse", {"field", "mask", "value"}},
      {"check", {"kind",   "width", "poly",   "init", "reflect_in", "reflect_out", "xor_out",
                 "from",   "to",    "at",     "size", "order",      "word",        "word_order",
                 "negate", "mask",  "pad_to", "text", "mark",       "covers_mark", "odd"}},
      {"text", {"separators", "collapse", "columns", "write"}},
      {"items", {"from", "to", "id_size", "length_size", "length_first", "length_includes_header", "order", "send"}},
      {"blocks", {"mask", "from", "sizes"}},
      {"layout", {"at", "parts"}},
      {"field",
       {"at", "column", "item", "block", "type", "bytes", "order", "group", "shift", "scale", "offset", "unit", "min",
        "max", "convert", "when", "preset"}},
      {"when", {"field", "modulus", "mask", "values"}},
      {"convert", {"step", "coefficients", "x", "y", "full", "reference", "r0_ohm", "a", "b", "c", "d"}},
      {"gyro", {"meaning", "unit", "arcsec_per_pulse", "wrap", "interval_s", "valid", "axes"}},
      {"axis", {"field", "sign", "valid"}},
      {"valid", {"field", "mask", "value"}},
      {"counter", {"field", "modulus", "step", "ticks_per_s", "step_varies"}},
      {"channel",
       {"field", "high", "low", "low_bits", "bits", "signed", "scale", "offset", "min", "max", "convert",
        "stale_after_s"}},
      {"role", {"field"}},
      {"vector", {"name", "hex", "text", "kind", "refused", "values", "tolerance"}},
  };
  return kKeys;
}

}  // namespace

const std::vector<std::string>& section_keys(std::string_view section) { return all_keys().find(section)->second; }

const std::vector<std::string>& section_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const auto& [name, keys] : all_keys()) names.push_back(name);
    return names;
  }();
  return kNames;
}

}  // namespace prism::wire
