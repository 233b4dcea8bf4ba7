// SPDX-License-Identifier: MIT
#include "tools/prismctl/screen/terminal.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

namespace prism::screen {
namespace {

bool speaks_utf8() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* value = std::getenv(name);
    if (value == nullptr || *value == '\0') continue;
    const std::string_view locale(value);
    return locale.find("UTF-8") != locale.npos || locale.find("utf8") != locale.npos;
  }
  return false;
}

// https://no-color.org
bool wants_colour() {
  const char* value = std::getenv("NO_COLOR");
  return value == nullptr || *value == '\0';
}

void put(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;  // terminal closed; its signal ends the program
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace

Terminal::Terminal() : style_{wants_colour(), speaks_utf8()} {
  if (::tcgetattr(STDIN_FILENO, &before_) == 0) keyboard_ = STDIN_FILENO;
  enter();
}

void Terminal::enter() {
  if (std::exchange(entered_, true)) return;
  if (keyboard_ >= 0) {
    termios keys = before_;
    keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // Ctrl-C and Ctrl-Z stay signals
    keys.c_cc[VMIN] = 0;
    keys.c_cc[VTIME] = 0;
    ::tcsetattr(keyboard_, TCSANOW, &keys);
  }
  put("\033[?1049h\033[?25l\033[?7l\033[2J");
}

void Terminal::leave() {
  if (!std::exchange(entered_, false)) return;
  put("\033[?7h\033[?25h\033[?1049l");
  if (keyboard_ >= 0) ::tcsetattr(keyboard_, TCSANOW, &before_);
}

Size Terminal::size() const {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0) return {};
  return {size.ws_col, size.ws_row};
}

void Terminal::draw(const std::vector<Line>& lines) const {
  std::string text = "\033[H";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    text += (i > 0 ? "\r\n\033[K" : "\033[K") + terminal_text(lines[i], style_);
  }
  put(text);
}

std::optional<char> Terminal::key() {
  char key = 0;
  const ssize_t size = keyboard_ >= 0 ? ::read(keyboard_, &key, 1) : 0;
  if (size == 1) return key;
  return std::nullopt;
}

bool terminal_has_screen() {
  const char* terminal = std::getenv("TERM");
  return ::isatty(STDOUT_FILENO) != 0 && terminal != nullptr && *terminal != '\0' &&
         std::string_view(terminal) != "dumb";
}

}  // namespace prism::screen
