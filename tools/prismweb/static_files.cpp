// SPDX-License-Identifier: MIT
#include "tools/prismweb/static_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

namespace prism::prismweb {
namespace {

constexpr off_t kMaxFileBytes = 16 << 20;

constexpr std::array<std::pair<std::string_view, std::string_view>, 11> kTypes = {{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".ico", "image/x-icon"},
    {".webmanifest", "application/manifest+json"},
    {".txt", "text/plain; charset=utf-8"},
    {".mjs", "text/javascript; charset=utf-8"},
}};

bool is_name(std::string_view name) {
  const auto fits = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-' || c == '.'; };
  return !name.empty() && name.front() != '.' && std::all_of(name.begin(), name.end(), fits);
}

}  // namespace

std::string_view media_type(std::string_view path) {
  for (const auto& [ending, type] : kTypes) {
    if (path.ends_with(ending)) return type;
  }
  return {};
}

std::string file_of_target(std::string_view target, int folders) {
  target = target.substr(0, target.find('?'));
  if (target == "/") return "index.html";
  if (!target.starts_with('/')) return "";
  const std::string_view path = target.substr(1);
  std::string_view rest = path;
  for (; folders >= 0; --folders) {
    const std::size_t slash = rest.find('/');
    if (!is_name(rest.substr(0, slash))) return "";
    if (slash == std::string_view::npos) return media_type(path).empty() ? "" : std::string(path);
    rest.remove_prefix(slash + 1);
  }
  return "";
}

StaticFile read_static(const std::string& folder, std::string_view target, int folders) {
  StaticFile file;
  const std::string name = file_of_target(target, folders);
  if (name.empty() || folder.empty()) return file;
  const int fd = ::open((folder + "/" + name).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return file;
  struct stat found {};
  if (::fstat(fd, &found) == 0 && S_ISREG(found.st_mode) && found.st_size <= kMaxFileBytes) {
    file.body.resize(static_cast<std::size_t>(found.st_size));
    const ssize_t size = ::pread(fd, file.body.data(), file.body.size(), 0);
    if (size == found.st_size) file.status = 200;
    file.media_type = media_type(name);
    file.etag = fmt::format("\"{:x}-{:x}-{:x}\"", found.st_ino, found.st_size,
                            found.st_mtim.tv_sec * 1'000'000'000 + found.st_mtim.tv_nsec);
  }
  ::close(fd);
  return file;
}

}  // namespace prism::prismweb
