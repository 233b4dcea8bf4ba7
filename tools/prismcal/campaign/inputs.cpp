// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/inputs.hpp"

#include <glob.h>

#include <algorithm>
#include <filesystem>

#include "base/file.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"

namespace prism::campaign {
namespace {

std::string metadata_of(const std::string& head, const std::string& key) {
  const std::string begin = "\n# " + key + ": ";
  const std::size_t at = head.find(begin);
  if (at == std::string::npos) return {};
  std::string value = head.substr(at + begin.size(), head.find('\n', at + 1) - at - begin.size());
  std::replace(value.begin(), value.end(), '\t', ' ');
  return value == "-" || value == "unknown" ? std::string() : value;
}

}  // namespace

Result<InputFile> read_input(const std::string& path) {
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  InputFile file{path, {}, {}, {}};
  Sha256 sha256;
  std::vector<char> buffer(1 << 20);
  bool first = true;
  while (const std::size_t got = in->read(buffer)) {
    const std::string_view bytes(buffer.data(), got);
    if (first) {
      const std::string head(bytes.substr(0, 8192));
      file.serial = metadata_of(head, "gyro_serial");
      file.axis = metadata_of(head, "axis");
    }
    first = false;
    sha256.add(bytes);
  }
  if (auto good = in->finish(); !good) return tl::unexpected<Error>(good.error());
  file.sha256 = sha256.hex();
  return file;
}

std::vector<std::string> files_of_recording(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return {path};
  std::vector<std::string> files = recordings::files_of(path, ".csv");
  for (std::string& index : recordings::files_of(path, ".index")) files.push_back(std::move(index));
  return files;
}

std::vector<std::string> paths_of_pattern(const std::string& pattern) {
  glob_t found{};
  std::vector<std::string> paths;
  if (::glob(pattern.c_str(), GLOB_BRACE, nullptr, &found) == 0)
    paths.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  ::globfree(&found);
  return paths;
}

}  // namespace prism::campaign
