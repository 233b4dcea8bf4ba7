// SPDX-License-Identifier: MIT
// `prismd --sniff`: finds the description and line settings that fit an unknown line or a file of bytes.

#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_document.hpp"
#include "compensation/model_text.hpp"
#include "config/search_path.hpp"
#include "daemon/line/live_line.hpp"
#include "daemon/program.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/transport/network_line.hpp"
#include "drivers/transport/transport.hpp"
#include "drivers/wire/decode/inspect.hpp"

namespace prism::daemon {
namespace {

namespace fs = std::filesystem;
using Steady = std::chrono::steady_clock;

constexpr auto kListen = std::chrono::milliseconds(1000);
constexpr auto kOpenWithin = std::chrono::seconds(10);
constexpr std::size_t kShownMisses = 3;
constexpr std::size_t kExplained = 1 << 20;  // bytes used to explain why one description does not fit

// Returns the requested description, or all from every directory of descriptions. Prints a message for each that cannot
// be read, and skips it.
std::vector<wire::FrameDescriptionPtr> descriptions_of(const std::string& asked) {
  std::vector<wire::FrameDescriptionPtr> descriptions;
  std::error_code error;
  const fs::path here = fs::current_path(error);
  std::vector<std::string> paths = {config::find_data_file(asked, "frames", here)};
  if (asked.empty()) paths = config::data_files("frames", here);
  for (const std::string& path : paths) {
    const Result<std::string> text = config::read_data_file(path, "frames", "DESCRIPTION");
    const auto description = text ? wire::parse_frame_description(*text, path) : tl::unexpected<Error>(text.error());
    if (description) {
      descriptions.push_back(*description);
    } else {
      fmt::print(stderr, "prismd: {}{}\n", asked.empty() ? "skipped: " : "", description.error().text());
    }
  }
  return descriptions;
}

std::string format_text(const wire::WireFormat& wire) {
  constexpr const char* kLetters[] = {"N", "E", "O"};
  return fmt::format("{} {}{}{}", wire.baud, wire.data_bits, kLetters[static_cast<int>(wire.parity)], wire.stop_bits);
}

// Prints the descriptions that fit, or the nearest misses, under `heading`. Returns true if one fits.
bool print_ranking(const wire::Sniffer& sniffer, const std::string& heading) {
  const std::vector<wire::SniffScore> ranking = sniffer.ranking();
  const bool any = !ranking.empty() && ranking.front().fits;
  fmt::print("{}: {}\n", heading,
             any                                                      ? "fits"
             : ranking.empty() || ranking.front().bytes == 0          ? "no byte came"
             : ranking.front().too_few && ranking.front().frames == 1 ? "one frame, too few to be sure"
             : ranking.front().too_few                                ? "two frames, too few to be sure"
                                                                      : "nothing fits");
  std::size_t shown = 0;
  for (const wire::SniffScore& score : ranking) {
    const bool worth = score.fits || (!any && (score.frames > 0 || score.has_gaps()) && shown < kShownMisses);
    if (!worth) continue;
    fmt::print("  {}\n", wire::sniff_line(score));
    ++shown;
  }
  return any;
}

bool sniff_file(const std::string& path, const std::vector<wire::FrameDescriptionPtr>& descriptions) {
  constexpr double kAtOnce = 1e12;  // bytes/s: raw bytes have no times
  Result<drivers::CaptureReader> reader = drivers::CaptureReader::open(path, kAtOnce);
  if (!reader) {
    fmt::print(stderr, "prismd: {}\n", reader.error().text());
    return false;
  }
  wire::Sniffer sniffer(descriptions);
  std::vector<std::uint8_t> first;
  while (const auto packet = reader->next()) {
    if (packet->event != drivers::CaptureEvent::kData) continue;
    sniffer.feed(packet->bytes, reader->is_bare() ? 0 : packet->time_ns);
    if (descriptions.size() == 1 && first.size() < kExplained)
      first.insert(first.end(), packet->bytes.begin(), packet->bytes.end());
  }
  const bool any = print_ranking(sniffer, path);
  if (any || descriptions.size() != 1) return any;
  if (const std::string why = wire::explain_checks(*descriptions.front(), first); !why.empty())
    fmt::print("  {}\n", printable(why));
  return false;
}

// The line settings of the descriptions, the most frequent first.
std::vector<wire::WireFormat> wire_formats(const std::vector<wire::FrameDescriptionPtr>& descriptions) {
  std::vector<wire::WireFormat> formats;
  for (const wire::FrameDescriptionPtr& description : descriptions) {
    if (std::find(formats.begin(), formats.end(), description->wire) == formats.end())
      formats.push_back(description->wire);
  }
  const auto count = [&](const wire::WireFormat& format) {
    return std::count_if(descriptions.begin(), descriptions.end(), [&](const auto& d) { return d->wire == format; });
  };
  std::stable_sort(formats.begin(), formats.end(), [&](const auto& a, const auto& b) { return count(a) > count(b); });
  return formats;
}

// Waits until the line is open; a serial device is open at once.
Result<void> wait_for(transport::Transport& line, const std::string& name) {
  std::array<std::uint8_t, 1> unused;
  for (const auto end = Steady::now() + kOpenWithin; !line.opening().empty();) {
    if (Steady::now() >= end) return make_error(name, line.opening());
    ::poll(nullptr, 0, 20);
    const transport::Received received = line.read(unused);
    if (received.kind == transport::Received::Kind::kLost) return make_error(name, received.why);
  }
  return {};
}

// Sends nothing.
Result<bool> sniff_line(const transport::Settings& settings, const std::string& heading,
                        const std::vector<wire::FrameDescriptionPtr>& descriptions) {
  const std::string device = transport::describe(settings);
  boost::asio::io_context io;
  auto opened = transport::open(io, settings);
  if (!opened) return tl::unexpected<Error>(opened.error());
  transport::Transport& line = **opened;
  if (auto ready = wait_for(line, device); !ready) return tl::unexpected<Error>(ready.error());
  wire::Sniffer sniffer(descriptions);
  const line::ArrivalClock clock;
  std::array<std::uint8_t, 65536> buffer;
  for (const auto end = Steady::now() + kListen; Steady::now() < end;) {
    pollfd wait{line.fd(), POLLIN, 0};
    if (::poll(&wait, 1, 100) <= 0) continue;
    const transport::Received received = line.read(buffer);
    if (received.kind == transport::Received::Kind::kLost)
      return make_error(device, "the line was lost while listening");
    if (received.bytes > 0) sniffer.feed({buffer.data(), received.bytes}, clock.now_ns());
  }
  return print_ranking(sniffer, heading);
}

// Result of run_sniff.
int code_of(const Result<bool>& fits) {
  if (fits) return *fits ? kExitDone : kExitFailed;
  fmt::print(stderr, "prismd: {}\n", fits.error().text());
  return kExitFailed;
}

}  // namespace

int run_sniff(const std::string& path, const std::string& description) {
  const std::vector<wire::FrameDescriptionPtr> descriptions = descriptions_of(description);
  if (descriptions.empty()) return kExitFailed;
  struct stat info {};
  const bool exists = ::stat(path.c_str(), &info) == 0;
  if (!exists && transport::parse_endpoint(path)) {
    transport::Settings settings;
    settings.network = {"tcp", path, false, ""};
    return code_of(sniff_line(settings, transport::describe(settings), descriptions));
  }
  if (!exists || !S_ISCHR(info.st_mode)) return sniff_file(path, descriptions) ? kExitDone : kExitFailed;
  Result<bool> fits;
  for (const wire::WireFormat& wire : wire_formats(descriptions)) {
    fits = sniff_line({path, wire}, path + " at " + format_text(wire), descriptions);
    if (!fits || *fits) break;
  }
  return code_of(fits);
}

int check_document(const std::string& path) {
  const Result<std::string> text = read_text_file(path, kMaxModelBytes);
  if (!text) return -1;
  const auto document = parse_json_object(*text, path);
  const Json format = document && document->value.contains("format") ? document->value["format"] : Json();
  const auto refused = [](const Error& error) {
    fmt::print(stderr, "prismd: {}\n", error.text());
    return kExitConfig;
  };
  if (format == "prism-model") {
    const auto model = compensation::parse_model(*text, path);
    if (!model) return refused(model.error());
    fmt::print("{}: good: model {}, {}\n", printable(path), (*model)->info().id.substr(0, 12), (*model)->info().name);
    return kExitDone;
  }
  if (format != "prism-frames") return -1;
  const auto description = wire::parse_frame_description(*text, path);
  if (!description) return refused(description.error());
  if (auto proved = wire::run_test_vectors(**description); !proved) return refused(proved.error());
  for (const std::string& warning : (*description)->warnings) fmt::print("note: {}\n", warning);
  if (const std::string file = fs::path(path).stem().string(); file != (*description)->name)
    fmt::print("note: a configuration finds it by its file, \"{}\"; its name \"{}\" is in logs and messages\n",
               printable(file), (*description)->name);
  fmt::print("{}: good: {}\n", printable(path), wire::proof_text(**description));
  return kExitDone;
}

}  // namespace prism::daemon
