// Connections that wait for gRPC.
#include "api/transport/hand_over_thread.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <future>
#include <vector>

#include "api/transport/listen.hpp"

namespace axisd::testing {
namespace {

using transport::HandOverThread;

TEST(HandOverThread, TakesThemInTheirOrder) {
  std::vector<int> taken, given;
  std::promise<void> last;
  const HandOverThread::HandOver take = [&](FileDescriptor connection) {
    taken.push_back(connection.get());
    if (taken.size() == 3) last.set_value();
  };
  const auto ends = {transport::connected_pair(), transport::connected_pair(), transport::connected_pair()};
  HandOverThread thread;
  thread.start();
  for (const auto& pair : ends) {
    const int end = dup(pair.first.get());
    given.push_back(end);
    thread.hand_over(0, take, FileDescriptor(end));
  }
  last.get_future().wait();
  thread.stop();
  EXPECT_EQ(taken, given);
}

TEST(HandOverThread, WhatIsTakenBackIsClosed) {
  std::promise<void> taken, go_on, last;
  std::vector<int> all;
  const HandOverThread::HandOver take = [&](const FileDescriptor& connection) {
    all.push_back(connection.get());
    if (all.size() > 1) return last.set_value();
    taken.set_value();
    go_on.get_future().wait();
  };
  HandOverThread thread;
  thread.start();
  thread.hand_over(1, take, transport::connected_pair().first);
  taken.get_future().wait();
  auto [ours, theirs] = transport::connected_pair();
  auto [other, stays] = transport::connected_pair();
  const int kept = stays.get();
  thread.hand_over(2, take, std::move(theirs));
  thread.hand_over(3, take, std::move(stays));
  thread.take_back(1);  // has been taken
  thread.take_back(2);
  char byte = 0;
  EXPECT_EQ(read(ours.get(), &byte, 1), 0) << "it is closed";
  go_on.set_value();
  last.get_future().wait();
  thread.stop();
  EXPECT_EQ(all.back(), kept);
}

/// gRPC reads for as long as something comes: whoever sends without a pause must not keep the end of the
/// daemon.
TEST(HandOverThread, StopsInTheMidstOfATaking) {
  auto [ours, theirs] = transport::connected_pair();
  std::promise<void> taken;
  const HandOverThread::HandOver take = [&](const FileDescriptor& connection) {
    taken.set_value();
    char byte = 0;
    while (read(connection.get(), &byte, 1) != 0) {
    }
  };
  HandOverThread thread;
  thread.start();
  thread.hand_over(0, take, std::move(theirs));
  taken.get_future().wait();
  thread.stop();
}

}  // namespace
}  // namespace axisd::testing
