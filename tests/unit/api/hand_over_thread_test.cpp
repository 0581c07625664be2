// Connections that wait for gRPC.
#include "api/transport/hand_over_thread.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <future>
#include <iterator>
#include <list>
#include <string>
#include <vector>

#include "api/transport/listen.hpp"
#include "api/transport/peer_socket.hpp"
#include "tests/support/stream_socket.hpp"

namespace axisd::testing {
namespace {

using transport::HandOverThread;

/// Both ends of a connection, and the further descriptor of the second one.
struct Ends {
  Ends() : Ends(transport::connected_pair()) {}
  explicit Ends(std::pair<FileDescriptor, FileDescriptor> pair)
      : ours(std::move(pair.first)),
        theirs(std::move(pair.second)),
        watched(std::make_shared<const FileDescriptor>(fcntl(theirs.get(), F_DUPFD_CLOEXEC, 0))) {}
  FileDescriptor ours, theirs;
  HandOverThread::Watched watched;
};

/// The kernel counts what comes on it.
std::pair<FileDescriptor, FileDescriptor> on_tcp() {
  const auto listening = test::stream_socket();
  sockaddr_in address{
      .sin_family = AF_INET, .sin_port = 0, .sin_addr = {htonl(INADDR_LOOPBACK)}, .sin_zero = {}};
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  EXPECT_EQ(::bind(listening.get(), any, size), 0);
  EXPECT_EQ(::listen(listening.get(), 1), 0);
  EXPECT_EQ(::getsockname(listening.get(), any, &size), 0);
  auto ours = test::stream_socket();
  EXPECT_EQ(::connect(ours.get(), any, size), 0);
  FileDescriptor theirs(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC));
  return {std::move(ours), std::move(theirs)};
}

/// Until the kernel has counted it at the other end. On TCP.
void send(const Ends& ends, std::size_t bytes) {
  const auto total = transport::traffic_of(ends.watched->get()).received + bytes;
  const std::string text(bytes, 'x');
  ASSERT_EQ(::send(ends.ours.get(), text.data(), text.size(), 0), std::ssize(text));
  while (transport::traffic_of(ends.watched->get()).received < total) std::this_thread::yield();
}

/// gRPC that is kept by each connection until its end.
class Kept {
 public:
  const HandOverThread::HandOver take = [this](const FileDescriptor& connection) {
    ++taken_;
    char byte = 0;
    ssize_t got = 1;
    while (got > 0 || (got < 0 && errno == EAGAIN)) got = read(connection.get(), &byte, 1);
  };
  void wait_for(int number) const {
    while (taken_ < number) std::this_thread::yield();
  }

 private:
  std::atomic<int> taken_{0};
};

TEST(HandOverThread, TakesAllThatComes) {
  std::mutex mutex;
  std::vector<int> taken, given;
  std::promise<void> last;
  const HandOverThread::HandOver take = [&](const FileDescriptor& connection) {
    const std::lock_guard lock(mutex);
    taken.push_back(connection.get());
    if (taken.size() == 3) last.set_value();
  };
  std::list<Ends> ends(3);
  HandOverThread thread;
  for (auto& each : ends) {
    given.push_back(each.theirs.get());
    thread.hand_over(0, take, std::move(each.theirs), each.watched);
  }
  thread.start();
  last.get_future().wait();
  thread.stop();
  EXPECT_THAT(taken, ::testing::UnorderedElementsAreArray(given));
}

TEST(HandOverThread, WhatIsTakenBackIsClosed) {
  const HandOverThread::HandOver take = [](const FileDescriptor& /*connection*/) {};
  HandOverThread thread;
  Ends first, second;
  thread.hand_over(1, take, std::move(first.theirs), std::exchange(first.watched, {}));
  thread.hand_over(2, take, std::move(second.theirs), second.watched);
  EXPECT_TRUE(thread.take_back(1));
  EXPECT_FALSE(thread.take_back(1));
  char byte = 0;
  EXPECT_EQ(read(first.ours.get(), &byte, 1), 0) << "it is closed";
  thread.start();
  EXPECT_EQ(fcntl(second.watched->get(), F_GETFD), FD_CLOEXEC);
  thread.stop();
}

/// gRPC reads for as long as something comes: whoever sends without a pause must not keep the end of the
/// daemon.
TEST(HandOverThread, StopInTheMidstOfATaking) {
  Ends ends;
  Kept grpc;
  HandOverThread thread;
  thread.start();
  thread.hand_over(0, grpc.take, std::move(ends.theirs), ends.watched);
  grpc.wait_for(1);
  thread.stop();
}

/// gRPC's acceptor keeps its mutex while it takes one in: whoever waits for that is not to blame.
TEST(HandOverThread, OnlyWhoIsInsideIsTold) {
  std::mutex mutex;
  Kept grpc;
  std::vector<FileDescriptor> honest;
  std::promise<void> all;
  const HandOverThread::HandOver keep = [&](FileDescriptor connection) {
    const std::lock_guard lock(mutex);
    grpc.take(std::move(connection));
  };
  const HandOverThread::HandOver take = [&](FileDescriptor connection) {
    const std::lock_guard lock(mutex);
    honest.push_back(std::move(connection));
    if (honest.size() == 4) all.set_value();
  };
  Ends first(on_tcp());
  std::list<Ends> others(4);
  HandOverThread thread;
  thread.start();
  const auto begin = monotonic_now();
  HandOverThread::Id id = 1;
  thread.hand_over(id, keep, std::move(first.theirs), first.watched);
  grpc.wait_for(1);
  const auto late = [] { return monotonic_now() + HandOverThread::patience; };
  EXPECT_FALSE(thread.kept_by(late()));
  send(first, HandOverThread::little + 1);
  ASSERT_TRUE(thread.kept_by(late())) << "nobody has to wait for that";
  for (auto& each : others) thread.hand_over(++id, take, std::move(each.theirs), each.watched);
  EXPECT_FALSE(thread.kept_by(begin)) << "not for long";
  const auto kept = thread.kept_by(late());
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->id, 1);
  EXPECT_EQ(kept->watched, first.watched);
  transport::reset(kept->watched->get());
  all.get_future().wait();
  while (thread.last_progress(TimePoint::max()) != TimePoint::max())
    std::this_thread::yield();  // is done with them
  EXPECT_FALSE(thread.take_back(id));
  thread.stop();
  char byte = 0;
  for (auto& each : others) {
    EXPECT_EQ(::recv(each.ours.get(), &byte, 1, MSG_DONTWAIT), -1) << "it is open";
    EXPECT_EQ(errno, EAGAIN);
  }
}

/// The process stood still, or gRPC waits for something else: whoever happens to be inside has done nothing.
TEST(HandOverThread, WhoSendsNoMoreIsNotToBlame) {
  Ends ends(on_tcp());
  Kept grpc;
  HandOverThread thread;
  thread.start();
  send(ends, 400);
  thread.hand_over(1, grpc.take, std::move(ends.theirs), ends.watched);
  grpc.wait_for(1);
  const auto late = monotonic_now() + HandOverThread::patience;
  EXPECT_FALSE(thread.kept_by(late));
  EXPECT_FALSE(thread.kept_by(late + std::chrono::hours(1)));
  send(ends, HandOverThread::little);
  EXPECT_FALSE(thread.kept_by(late));
  send(ends, 1);
  EXPECT_TRUE(thread.kept_by(late));
  thread.stop();
}

TEST(HandOverThread, TheWatchdogSeesWhoeverIsInside) {
  Ends first, second, third;
  Kept grpc;
  HandOverThread thread;
  thread.start();
  const auto later = monotonic_now() + std::chrono::hours(1);
  EXPECT_EQ(thread.last_progress(later), later);
  thread.hand_over(1, grpc.take, std::move(first.theirs), first.watched);
  grpc.wait_for(1);
  const auto owed = thread.last_progress(later);
  EXPECT_LE(owed, monotonic_now());
  // However often those that wait give up, and others come.
  thread.hand_over(2, grpc.take, std::move(second.theirs), second.watched);
  EXPECT_TRUE(thread.take_back(2));
  EXPECT_EQ(thread.last_progress(later), owed);
  thread.hand_over(3, grpc.take, std::move(third.theirs), third.watched);
  EXPECT_EQ(thread.last_progress(later), owed);
  first.ours = {};
  grpc.wait_for(2);
  EXPECT_GT(thread.last_progress(later), owed) << "it came round";
  third.ours = {};
  while (thread.last_progress(later) != later) std::this_thread::yield();
  thread.stop();
}

TEST(HandOverThread, NothingIsOwedToWhoWasTakenBackInTime) {
  Ends ends;
  Kept grpc;
  HandOverThread thread;
  const auto later = monotonic_now() + std::chrono::hours(1);
  thread.hand_over(1, grpc.take, std::move(ends.theirs), ends.watched);
  EXPECT_TRUE(thread.take_back(1));
  EXPECT_LT(thread.last_progress(later), later) << "the thread has not come round";
  thread.start();
  while (thread.last_progress(later) != later) std::this_thread::yield();
  thread.stop();
}

/// Whatever has come before: gRPC's own threads read it, and none of these.
TEST(HandOverThread, NobodyHearsOfWhatHasComeUntilItIsHandedOver) {
  Ends ends(on_tcp());
  ASSERT_EQ(::send(ends.ours.get(), "hello", 5, MSG_NOSIGNAL), 5);
  pollfd told{.fd = ends.watched->get(), .events = POLLIN, .revents = 0};
  ASSERT_EQ(::poll(&told, 1, -1), 1) << "it is there";
  std::promise<int> seen;
  FileDescriptor kept;
  const HandOverThread::HandOver take = [&](FileDescriptor connection) {
    pollfd meanwhile{.fd = connection.get(), .events = POLLIN, .revents = 0};
    kept = std::move(connection);
    seen.set_value(::poll(&meanwhile, 1, 0));
  };
  HandOverThread thread;
  thread.start();
  thread.hand_over(0, take, std::move(ends.theirs), ends.watched);
  EXPECT_EQ(seen.get_future().get(), 0);
  EXPECT_EQ(::poll(&told, 1, -1), 1) << "as soon as it has been";
  thread.stop();
}

}  // namespace
}  // namespace axisd::testing
