// The daemon connects to its own addresses, to see that clients can.
#include "api/transport/knock.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <optional>
#include <string>
#include <utility>

#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

class Knock : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    const auto address =
        GetParam() == "unix" ? "unix:" + (directory_ / "a.sock") : GetParam() + std::string(":0");
    auto sockets = transport::listen_on(address, true);
    if (!sockets && GetParam().starts_with('[')) GTEST_SKIP() << "no IPv6 here";
    ASSERT_TRUE(sockets) << to_string(sockets.error());
    socket_ = std::move(sockets->front());
  }
  [[nodiscard]] transport::Knock& knock() { return *socket_.knock; }
  /// Whether the next that waits to be let in was the daemon itself; nothing: nobody waits.
  std::optional<bool> let_in() {
    const FileDescriptor connection(accept4(socket_.fd.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (connection.get() < 0) return std::nullopt;
    return knock().let_in(connection.get());
  }
  /// A client comes.
  FileDescriptor stranger() {
    sockaddr_storage target{};
    socklen_t size = sizeof target;
    EXPECT_EQ(getsockname(socket_.fd.get(), reinterpret_cast<sockaddr*>(&target), &size), 0);
    FileDescriptor client(socket(target.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(connect(client.get(), reinterpret_cast<sockaddr*>(&target), size), 0);
    return client;
  }
  [[nodiscard]] bool is_answered() { return knock().unanswered_since() == TimePoint::max(); }

  TemporaryDirectory directory_;
  transport::ListeningSocket socket_;
};

TEST_P(Knock, IsAnsweredByWhoeverAccepts) {
  for (int i = 0; i < 3; ++i) {
    knock().knock();
    EXPECT_EQ(let_in(), true);
    EXPECT_TRUE(is_answered());
    EXPECT_EQ(let_in(), std::nullopt) << "once";
  }
}

TEST_P(Knock, OwesSinceItKnockedFirst) {
  knock().knock();
  EXPECT_TRUE(is_answered()) << "it may be that it never gets in here";
  EXPECT_EQ(let_in(), true);
  const auto begun = monotonic_now();
  knock().knock();
  const auto since = knock().unanswered_since();
  EXPECT_GE(since, begun);
  EXPECT_LE(since, monotonic_now());
  knock().knock();
  EXPECT_EQ(knock().unanswered_since(), since);
  EXPECT_EQ(let_in(), true);
  EXPECT_TRUE(is_answered());
  EXPECT_EQ(let_in(), std::nullopt) << "one is on its way at a time";
}

TEST_P(Knock, ThatAStrangerIsLetInIsAnAnswer) {
  knock().knock();
  EXPECT_EQ(let_in(), true);
  const auto client = stranger();
  knock().knock();
  EXPECT_FALSE(is_answered());
  EXPECT_EQ(let_in(), false);
  EXPECT_TRUE(is_answered());
  EXPECT_EQ(let_in(), true);
}

TEST_P(Knock, TellsThatNobodyListensAnyMore) {
  knock().knock();
  EXPECT_EQ(let_in(), true);
  socket_.fd = {};
  for (int i = 0; i < 3; ++i) {
    knock().knock();
    EXPECT_FALSE(is_answered());
  }
}

std::string name_of(const ::testing::TestParamInfo<std::string>& info) {
  constexpr std::array names{"Loopback", "Everywhere", "Loopback6", "Everywhere6", "Unix"};
  return names.at(info.index);
}

INSTANTIATE_TEST_SUITE_P(Addresses, Knock, ::testing::Values("127.0.0.1", "0.0.0.0", "[::1]", "[::]", "unix"),
                         name_of);

}  // namespace
}  // namespace axisd::testing
