// SPDX-License-Identifier: MIT
// The terminal while the live screen has it: its other page, no cursor, keys one by one.
#pragma once

#include <termios.h>

#include <optional>
#include <vector>

#include "tools/prismctl/screen/styled_text.hpp"
#include "tools/prismctl/screen/view.hpp"

namespace prism::screen {

/// Plain VT sequences, which every terminal of today, a multiplexer's and the Linux console's understand alike.
class Terminal {
 public:
  Terminal();
  ~Terminal() { leave(); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// As found when it was entered: after a stop by Ctrl-Z, leave() and enter() again.
  void enter();
  void leave();

  Size size() const;
  void draw(const std::vector<Line>& lines) const;

  /// Where keys come from; −1: there is no keyboard.
  int keyboard() const { return keyboard_; }
  /// The next key; nothing where none waits.
  std::optional<char> key();

  bool utf8() const { return style_.utf8; }

 private:
  Style style_;
  int keyboard_ = -1;
  bool entered_ = false;
  termios before_{};
};

/// False where stdout is no terminal, or one that can only print lines (TERM=dumb).
bool terminal_has_screen();

}  // namespace prism::screen
