// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/inputs.hpp"

#include <fmt/format.h>
#include <glob.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "base/file.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"

namespace prism::campaign {
namespace {

constexpr std::int64_t kMinAge_ns = 2'000'000'000;  // a younger file may change within the same mtime
constexpr const char* kFirstLine = "# prism inputs 1";

std::string metadata_of(const std::string& head, const std::string& key) {
  const std::string begin = "\n# " + key + ": ";
  const std::size_t at = head.find(begin);
  if (at == std::string::npos) return {};
  std::string value = head.substr(at + begin.size(), head.find('\n', at + 1) - at - begin.size());
  std::replace(value.begin(), value.end(), '\t', ' ');
  return value == "-" || value == "unknown" ? std::string() : value;
}

Result<InputFile> read_input(const std::string& path) {
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  InputFile file{path, {}, {}, {}, 0, 0};
  Sha256 sha256;
  std::vector<char> buffer(1 << 20);
  while (const std::size_t got = in->read(buffer)) {
    const std::string_view bytes(buffer.data(), got);
    if (file.bytes == 0) {
      const std::string head(bytes.substr(0, 8192));
      file.serial = metadata_of(head, "gyro_serial");
      file.axis = metadata_of(head, "axis");
    }
    sha256.add(bytes);
    file.bytes += bytes.size();
    file.lines += static_cast<std::uint64_t>(std::count(bytes.begin(), bytes.end(), '\n'));
  }
  if (auto good = in->finish(); !good) return tl::unexpected<Error>(good.error());
  file.sha256 = sha256.hex();
  return file;
}

std::int64_t now_ns() { return std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1); }

}  // namespace

InputCache::InputCache(std::string file) : file_(std::move(file)) {
  auto in = FileReader::open(file_);
  std::string line;
  if (!in || !in->read_line(line) || line != kFirstLine) return;
  while (in->read_line(line)) {
    std::istringstream fields(line);
    Entry entry;
    Stamp& s = entry.stamp;
    InputFile& f = entry.file;
    fields >> s.size >> s.changed_ns >> s.inode >> s.device >> f.lines >> f.sha256;
    fields.ignore(1);
    if (!std::getline(fields, f.serial, '\t') || !std::getline(fields, f.axis, '\t') || !std::getline(fields, f.path))
      continue;
    f.bytes = s.size;
    entries_[f.path] = std::move(entry);
  }
}

Result<InputFile> InputCache::describe(const std::string& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) return make_error(path, std::strerror(errno));
  const Stamp stamp{static_cast<std::uint64_t>(found.st_size), found.st_ino, found.st_dev,
                    found.st_mtim.tv_sec * std::int64_t{1'000'000'000} + found.st_mtim.tv_nsec};
  const auto known = entries_.find(path);
  if (known != entries_.end() && known->second.stamp == stamp) return known->second.file;
  const bool cacheable = now_ns() - stamp.changed_ns > kMinAge_ns;
  auto file = read_input(path);
  if (!file) return file;
  ++files_read_;
  if (cacheable && path.find('\n') == std::string::npos) entries_[path] = {stamp, *file};
  return file;
}

Result<void> InputCache::save() {
  if (files_read_ == 0) return {};
  std::string text = std::string(kFirstLine) + "\n";
  for (const auto& [path, entry] : entries_) {
    const Stamp& s = entry.stamp;
    text += fmt::format("{} {} {} {} {} {}\t{}\t{}\t{}\n", s.size, s.changed_ns, s.inode, s.device, entry.file.lines,
                        entry.file.sha256, entry.file.serial, entry.file.axis, path);
  }
  return write_text_file(file_, text);
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
