// Connections that wait for gRPC.
#include "api/transport/hand_over_threads.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <future>
#include <list>
#include <vector>

#include "api/transport/listen.hpp"

namespace axisd::testing {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;
using transport::HandOverThreads;

/// Both ends of a connection, and the further descriptor of the second one.
struct Ends {
  Ends() : Ends(transport::connected_pair()) {}
  explicit Ends(std::pair<FileDescriptor, FileDescriptor> pair)
      : ours(std::move(pair.first)),
        theirs(std::move(pair.second)),
        watched(std::make_shared<const FileDescriptor>(fcntl(theirs.get(), F_DUPFD_CLOEXEC, 0))) {}
  FileDescriptor ours, theirs;
  HandOverThreads::Watched watched;
};

/// gRPC that is kept by each connection until its end.
class Kept {
 public:
  const HandOverThreads::HandOver take = [this](const FileDescriptor& connection) {
    ++taken_;
    char byte = 0;
    while (read(connection.get(), &byte, 1) != 0) {
    }
  };
  void wait_for(int number) const {
    while (taken_ < number) std::this_thread::yield();
  }

 private:
  std::atomic<int> taken_{0};
};

TEST(HandOverThreads, TakeAllThatComes) {
  std::mutex mutex;
  std::vector<int> taken, given;
  std::promise<void> last;
  const HandOverThreads::HandOver take = [&](const FileDescriptor& connection) {
    const std::lock_guard lock(mutex);
    taken.push_back(connection.get());
    if (taken.size() == 3) last.set_value();
  };
  std::list<Ends> ends(3);
  HandOverThreads threads;
  for (auto& each : ends) {
    given.push_back(each.theirs.get());
    threads.hand_over(0, take, std::move(each.theirs), each.watched);
  }
  threads.start();
  last.get_future().wait();
  threads.stop();
  EXPECT_THAT(taken, ::testing::UnorderedElementsAreArray(given));
}

TEST(HandOverThreads, WhatIsTakenBackIsClosed) {
  const HandOverThreads::HandOver take = [](const FileDescriptor& /*connection*/) {};
  HandOverThreads threads;
  Ends first, second;
  threads.hand_over(1, take, std::move(first.theirs), std::exchange(first.watched, {}));
  threads.hand_over(2, take, std::move(second.theirs), second.watched);
  EXPECT_TRUE(threads.take_back(1));
  EXPECT_FALSE(threads.take_back(1));
  char byte = 0;
  EXPECT_EQ(read(first.ours.get(), &byte, 1), 0) << "it is closed";
  threads.start();
  EXPECT_EQ(fcntl(second.watched->get(), F_GETFD), FD_CLOEXEC);
  threads.stop();
}

/// gRPC reads for as long as something comes: whoever sends without a pause must not keep the end of the
/// daemon.
TEST(HandOverThreads, StopInTheMidstOfATaking) {
  Ends ends;
  Kept grpc;
  HandOverThreads threads;
  threads.start();
  threads.hand_over(0, grpc.take, std::move(ends.theirs), ends.watched);
  grpc.wait_for(1);
  threads.stop();
}

TEST(HandOverThreads, WhoKeepsAllOfThemWhileOthersWaitIsTold) {
  constexpr int all = HandOverThreads::number;
  std::list<Ends> ends(all + 1);
  Kept grpc;
  HandOverThreads threads;
  threads.start();
  HandOverThreads::Id id = 0;
  auto next = ends.begin();
  const auto bring = [&] {
    threads.hand_over(++id, grpc.take, std::move(next->theirs), next->watched);
    ++next;
  };
  const auto begin = monotonic_now();
  for (int i = 1; i < all; ++i) bring();
  grpc.wait_for(all - 1);
  const auto late = [] { return monotonic_now() + HandOverThreads::patience; };
  EXPECT_THAT(threads.keeping_others(late()), IsEmpty()) << "one thread is free";
  bring();
  grpc.wait_for(all);
  EXPECT_THAT(threads.keeping_others(late()), IsEmpty()) << "nobody waits";
  const auto much_later = late() + HandOverThreads::patience;
  EXPECT_EQ(threads.last_progress(much_later), much_later);
  bring();
  EXPECT_THAT(threads.keeping_others(begin), IsEmpty()) << "not for long";
  EXPECT_THAT(threads.keeping_others(late()), UnorderedElementsAre(1, 2, 3, 4));
  EXPECT_GE(threads.last_progress(much_later), begin);
  EXPECT_LT(threads.last_progress(much_later), much_later) << "the watchdog sees it";
  ends.front().ours = {};  // it is ended: the one that waits has its thread
  grpc.wait_for(all + 1);
  EXPECT_EQ(threads.last_progress(much_later), much_later);
  threads.stop();
}

/// Whatever has come before: gRPC's own threads read it, and none of these.
TEST(HandOverThreads, NobodyHearsOfWhatHasComeUntilItIsHandedOver) {
  const FileDescriptor listening(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{
      .sin_family = AF_INET, .sin_port = 0, .sin_addr = {htonl(INADDR_LOOPBACK)}, .sin_zero = {}};
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  ASSERT_EQ(::bind(listening.get(), any, size), 0);
  ASSERT_EQ(::listen(listening.get(), 1), 0);
  ASSERT_EQ(::getsockname(listening.get(), any, &size), 0);
  FileDescriptor ours(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  ASSERT_EQ(::connect(ours.get(), any, size), 0);
  Ends ends({std::move(ours), FileDescriptor(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC))});
  ASSERT_EQ(::send(ends.ours.get(), "hello", 5, MSG_NOSIGNAL), 5);
  pollfd told{.fd = ends.watched->get(), .events = POLLIN, .revents = 0};
  ASSERT_EQ(::poll(&told, 1, -1), 1) << "it is there";
  std::promise<int> seen;
  FileDescriptor kept;
  const HandOverThreads::HandOver take = [&](FileDescriptor connection) {
    pollfd meanwhile{.fd = connection.get(), .events = POLLIN, .revents = 0};
    kept = std::move(connection);
    seen.set_value(::poll(&meanwhile, 1, 0));
  };
  HandOverThreads threads;
  threads.start();
  threads.hand_over(0, take, std::move(ends.theirs), ends.watched);
  EXPECT_EQ(seen.get_future().get(), 0);
  EXPECT_EQ(::poll(&told, 1, -1), 1) << "as soon as it has been";
  threads.stop();
}

}  // namespace
}  // namespace axisd::testing
