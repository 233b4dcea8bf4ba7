// SPDX-License-Identifier: MIT
#include "tools/client/instances.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <map>
#include <set>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "base/plain_text.hpp"
#include "config/socket_path.hpp"

namespace prism::client {
namespace {

void add_folder(std::vector<InstanceSocket>& found, const std::string& folder, std::vector<std::string>* invalid) {
  for (const std::string& path : config::sockets_in(folder, invalid))
    found.push_back({config::instance_name(path), path});
}

std::vector<InstanceSocket> all_places(std::vector<std::string>* invalid) {
  std::vector<InstanceSocket> found;
  for (const std::string& folder : config::socket_folders()) add_folder(found, folder, invalid);
  return found;
}

std::string path_of(const std::string& entry, const std::vector<InstanceSocket>& all) {
  if (entry.find('/') != std::string::npos) return entry;
  const auto named = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == entry; });
  return named != all.end() ? named->path : config::default_socket(entry);
}

// Also true without permission to connect: it is running.
bool accepts(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return false;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return true;
  return errno == EACCES || errno == EAGAIN;  // EAGAIN: blocked, its queue of connections is full
}

std::string unknown_name(const std::string& name, const std::vector<std::string>& running) {
  const std::string near = nearest_name(name, running);
  const std::string all = fmt::format("{}", fmt::join(running, ", "));
  if (near.empty()) return fmt::format("found \"{}\", expected one of: {}", name, all);
  return fmt::format("found \"{}\", did you mean \"{}\"? Running: {}", name, near, all);
}

}  // namespace

std::optional<std::string> instances_error(const std::vector<std::string>& entries) {
  std::set<std::string> names;
  for (const std::string& entry : entries) {
    if (entry.empty()) return "contains an empty string, expected names, sockets or directories/";
    if (entry.back() == '/') continue;
    const std::string name = config::instance_name(entry);
    if (!follows(TextRule::kName, name))
      return fmt::format("found \"{}\", expected a name of {}", shortened(name), rule_text(TextRule::kName));
    if (!names.insert(name).second) return fmt::format("found \"{}\" twice", name);
  }
  return std::nullopt;
}

std::vector<InstanceSocket> list_instances(const std::vector<std::string>& entries, std::vector<std::string>* invalid) {
  if (entries.empty()) return all_places(invalid);
  const std::vector<InstanceSocket> all = all_places(nullptr);
  std::vector<InstanceSocket> found;
  for (const std::string& entry : entries) {
    if (entry.ends_with('/')) {
      add_folder(found, entry, invalid);
      continue;
    }
    const std::string path = path_of(entry, all), name = config::instance_name(path);
    if (follows(TextRule::kName, name)) {
      found.push_back({name, path});
    } else if (invalid != nullptr) {
      invalid->push_back(printable(path));
    }
  }
  return found;
}

std::vector<std::string> running_sockets(std::vector<std::string>* invalid) {
  std::map<std::string, std::string> found;
  for (const auto& [name, path] : list_instances({}, invalid)) {
    if (found.count(name) == 0 && (config::would_start(path) || accepts(path))) found[name] = path;
  }
  std::vector<std::string> paths;
  for (const auto& [name, path] : found) paths.push_back(path);
  return paths;
}

Result<std::string> find_socket(const std::string& socket, const std::string& name) {
  if (!socket.empty()) return socket;
  const char* environment = std::getenv("PRISM_SOCKET");
  if (name.empty() && environment != nullptr && *environment != '\0') return std::string(environment);
  const std::vector<std::string> running = running_sockets();
  std::vector<std::string> matching, names;
  for (const std::string& path : running) {
    names.push_back(config::instance_name(path));
    if (name.empty() || names.back() == name) matching.push_back(path);
  }
  if (matching.size() == 1) return matching[0];
  if (running.empty())
    return make_error(fmt::format("{}", fmt::join(config::socket_folders(), ", ")),
                      "no prismd answers here; start one, or name its socket with --socket");
  if (matching.empty()) return make_error("--name", unknown_name(name, names));
  return make_error("--name",
                    fmt::format("required if several instances run; choose one of: {}", fmt::join(names, ", ")));
}

}  // namespace prism::client
