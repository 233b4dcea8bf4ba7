// SPDX-License-Identifier: MIT
#include "tools/prismweb/connection.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace prism::prismweb {
namespace {

struct Connections {
  std::shared_ptr<ConnectionList> list = std::make_shared<ConnectionList>();
  std::vector<std::shared_ptr<Connection>> all;
  std::vector<std::unique_ptr<ConnectionList::Entry>> entries;

  Connection& add() {
    all.push_back(std::make_shared<Connection>());
    all.back()->fd = -1;
    entries.push_back(std::make_unique<ConnectionList::Entry>(list, all.back()));
    return *all.back();
  }
  /// Index of the closed connection; -1 if none.
  int ended() const {
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i]->is_ending) return static_cast<int>(i);
    }
    return -1;
  }
};

TEST(ConnectionList, ClosesNoneBelowTheLimit) {
  Connections connections;
  for (int i = 0; i < 127; ++i) connections.add();
  EXPECT_TRUE(connections.list->make_room());
  EXPECT_EQ(connections.ended(), -1);
}

TEST(ConnectionList, ClosesTheOldestOfAnUnknownClient) {
  Connections connections;
  for (int i = 0; i < 128; ++i) connections.add();
  connections.all[0]->is_known = connections.all[1]->is_known = true;
  EXPECT_TRUE(connections.list->make_room());
  EXPECT_EQ(connections.ended(), 2);
}

TEST(ConnectionList, ClosesNoKnownClient) {
  Connections connections;
  for (int i = 0; i < 128; ++i) connections.add().is_known = true;
  EXPECT_FALSE(connections.list->make_room());
}

}  // namespace
}  // namespace prism::prismweb
