// The WebSocket of one page's lane.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "api/web/gateway/gateway.hpp"
#include "api/web/gateway/lane_state.hpp"
#include "api/web/gateway/shares.hpp"
#include "api/web/gateway/transport.hpp"
#include "buses/clock.hpp"

namespace axisd::web {

/// Carries bytes to and from LaneState, and out what that says. Keeps itself until the page is gone and
/// nothing is owed to any axis. Thread: the gateway's.
class LaneSocket final : public Guest, public std::enable_shared_from_this<LaneSocket> {
 public:
  using Head = boost::beast::http::request<boost::beast::http::empty_body>;
  /// `daemon`: the machine that the lane is for; outlives it.
  LaneSocket(Gateway& gateway, Upstream& daemon, Transport transport, Known known, Shares::Place lane,
             Shares::Place connection);
  /// `head`: asks for a WebSocket.
  void start(Head head);

  void close() override { shut("this session is over"); }
  [[nodiscard]] std::optional<TimePoint> idle_since() const override { return std::nullopt; }
  [[nodiscard]] std::uint64_t session() const override { return known_.session; }
  [[nodiscard]] const Person* person() const override { return &known_.person; }

 private:
  void read();
  void take(std::string_view bytes);
  void carry_out(const LaneEffects& effects);
  void ask(const LaneCall& call);
  void send(std::string bytes);
  void write();
  void shut(std::string_view why);
  /// The page is gone.
  void lost();
  void watch_time();

  Gateway& gateway_;
  Upstream& daemon_;
  const Known known_;
  Shares::Place lane_, connection_;
  boost::beast::websocket::stream<Transport> socket_;
  boost::beast::flat_buffer buffer_;
  Head head_;
  LaneState state_;
  std::deque<std::string> out_;
  std::size_t out_size_ = 0;
  bool closed_ = false;
  Clock::Timer timer_, end_;
};

}  // namespace axisd::web
