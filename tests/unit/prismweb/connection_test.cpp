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

  Connection& add(const std::string& address) {
    all.push_back(std::make_shared<Connection>());
    all.back()->fd = -1;
    all.back()->address = address;
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

bool no_failures(const std::string&) { return false; }

TEST(ConnectionList, ClosesNoneBelowTheLimit) {
  Connections connections;
  for (int i = 0; i < 127; ++i) connections.add("a");
  EXPECT_TRUE(connections.list->make_room(no_failures));
  EXPECT_EQ(connections.ended(), -1);
}

TEST(ConnectionList, ClosesTheOldestOfTheAddressWithMost) {
  Connections connections;
  connections.add("single");
  for (int i = 0; i < 127; ++i) connections.add(i % 3 == 0 ? "few" : "many");
  connections.all[2]->is_known = true;
  EXPECT_TRUE(connections.list->make_room(no_failures));
  EXPECT_EQ(connections.ended(), 3);
}

TEST(ConnectionList, ClosesThoseWithWrongPasswordsFirst) {
  Connections connections;
  connections.add("client");
  for (int i = 0; i < 127; ++i) connections.add(i == 60 ? "guesser" : "many");
  bool has_ended = false;
  connections.all[61]->on_end = [&] { has_ended = true; };
  EXPECT_TRUE(connections.list->make_room([](const std::string& address) { return address == "guesser"; }));
  EXPECT_EQ(connections.ended(), 61);
  EXPECT_TRUE(has_ended) << "its pending password check is cancelled";
}

TEST(ConnectionList, ClosesNoKnownClient) {
  Connections connections;
  for (int i = 0; i < 128; ++i) connections.add("a").is_known = true;
  EXPECT_FALSE(connections.list->make_room(no_failures));
}

TEST(ConnectionList, ClosesTheConnectionsOfUsers) {
  Connections connections;
  int closed = 0;
  connections.add("a").user = "removed";
  connections.add("a").user = "stays";
  connections.add("a").user = "removed";
  connections.all[2]->close_websocket = [&] { ++closed; };
  connections.list->close_users({"removed"});
  EXPECT_TRUE(connections.all[0]->is_ending);
  EXPECT_FALSE(connections.all[1]->is_ending);
  EXPECT_EQ(closed, 1);
}

}  // namespace
}  // namespace prism::prismweb
