// SPDX-License-Identifier: MIT
// The terminal of the live screen: alternate screen, hidden cursor, unbuffered keys.
#pragma once

#include <termios.h>

#include <optional>
#include <vector>

#include "tools/prismctl/screen/styled_text.hpp"
#include "tools/prismctl/screen/view.hpp"

namespace prism::screen {

/// Uses plain VT sequences, which all current terminals, multiplexers and the Linux console support.
class Terminal {
 public:
  Terminal();
  ~Terminal() { leave(); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// Restores the state before enter(). After a stop by Ctrl-Z call leave() and enter() again.
  void enter();
  void leave();

  Size size() const;
  void draw(const std::vector<Line>& lines) const;

  /// Descriptor of the keyboard; −1: none.
  int keyboard() const { return keyboard_; }
  /// Returns the next key; nullopt if no key was pressed.
  std::optional<char> key();

  bool utf8() const { return style_.utf8; }

 private:
  Style style_;
  int keyboard_ = -1;
  bool entered_ = false;
  termios before_{};
};

/// Returns false if stdout is not a terminal, or can only print lines (TERM=dumb).
bool terminal_has_screen();

}  // namespace prism::screen
