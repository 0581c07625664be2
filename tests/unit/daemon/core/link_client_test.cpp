#include "daemon/core/link_client.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "tests/support/virtual_world.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using boost::asio::local::stream_protocol;

/// A helper on the same thread: real sockets, virtual time.
class Helper : public testing::Test {
 protected:
  Helper() { std::filesystem::remove(path_); }
  ~Helper() override { std::filesystem::remove(path_); }

  /// Takes one connection: reads a line, says `answer`, and closes if `hang_up`.
  void serve(std::string answer, bool hang_up = true) {
    acceptor_.emplace(world_.executor(), stream_protocol::endpoint(path_));
    answer_ = std::move(answer);
    acceptor_->async_accept(peer_, [this, hang_up](const boost::system::error_code& error) {
      ASSERT_FALSE(error);
      boost::asio::async_read_until(peer_, boost::asio::dynamic_buffer(line_), '\n',
                                    [this, hang_up](const boost::system::error_code&, std::size_t) {
                                      boost::system::error_code gone;
                                      boost::asio::write(peer_, boost::asio::buffer(answer_), gone);
                                      if (hang_up) peer_.close();
                                    });
    });
  }
  Result<void> cycle() {
    std::optional<Result<void>> result;
    client_.cycle("can0", [&](const Result<void>& answer) { result = answer; });
    EXPECT_FALSE(result) << "called back from within the call";
    EXPECT_TRUE(world_.run_until([&] { return result.has_value(); }, 1min));
    return result.value_or(fail(Reason::internal, "no answer"));
  }

  test::VirtualWorld world_;
  std::string path_ = testing::TempDir() + "axisd-link-test-" + std::to_string(::getpid());
  LinkClient client_{world_.executor(), world_.clock(), path_};
  std::optional<stream_protocol::acceptor> acceptor_;
  stream_protocol::socket peer_{world_.executor()};
  std::string answer_, line_;
};

TEST_F(Helper, IsAskedAndAnswers) {
  serve("ok\n");
  EXPECT_TRUE(cycle());
  EXPECT_EQ(line_, "cycle can0\n");
}

TEST_F(Helper, IsAskedWhetherItWould) {
  serve("ok\n");
  std::optional<Result<void>> result;
  client_.check("can1", [&](const Result<void>& answer) { result = answer; });
  world_.run_for(1ms);
  EXPECT_EQ(line_, "check can1\n");
  ASSERT_TRUE(result);
  EXPECT_TRUE(*result);
}

TEST_F(Helper, SaysWhyItRefuses) {
  serve("error can0 is not among the links\n");
  const auto refused = cycle();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "the link helper: can0 is not among the links");
  EXPECT_FALSE(refused.error().remedy.empty());
}

TEST_F(Helper, IsNotThere) {
  const auto missing = cycle();
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().reason, Reason::bus_down);
  EXPECT_NE(missing.error().message.find(path_), std::string::npos);
  EXPECT_NE(missing.error().remedy.find("axisd-link.socket"), std::string::npos);
}

TEST_F(Helper, HangsUp) {
  serve("");
  EXPECT_NE(cycle().error().message.find("closed"), std::string::npos);
}

TEST_F(Helper, DoesNotAnswerInTime) {
  serve("", false);
  const auto begun = world_.now();
  EXPECT_NE(cycle().error().message.find("does not answer"), std::string::npos);
  EXPECT_EQ(world_.now() - begun, LinkClient::patience);
}

TEST_F(Helper, TalksTooMuch) {
  serve(std::string(5000, 'x'));
  EXPECT_FALSE(cycle());
}

TEST_F(Helper, NobodyIsCalledOnceTheClientIsGone) {
  serve("ok\n");
  bool called = false;
  {
    LinkClient client(world_.executor(), world_.clock(), path_);
    client.cycle("can0", [&](const Result<void>&) { called = true; });
  }
  world_.run_for(1min);
  EXPECT_FALSE(called);
}

TEST(LinkClient, APathThatIsTooLongIsAnError) {
  test::VirtualWorld world;
  LinkClient client(world.executor(), world.clock(), std::string(200, 'x'));
  std::optional<Result<void>> result;
  client.cycle("can0", [&](const Result<void>& answer) { result = answer; });
  world.run_for(1ms);
  ASSERT_TRUE(result);
  EXPECT_FALSE(*result);
}

}  // namespace
}  // namespace axisd::core
