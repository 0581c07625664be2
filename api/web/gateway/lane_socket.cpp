#include "api/web/gateway/lane_socket.hpp"

#include <sodium.h>
#include <spdlog/spdlog.h>

#include <utility>
#include <variant>

namespace axisd::web {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using ErrorCode = boost::system::error_code;

namespace {

/// Answers that a page has not taken.
constexpr std::size_t most_out = std::size_t{1024} * 1024;
/// Until a page has said goodbye in turn.
constexpr Duration goodbye = std::chrono::seconds(1);

std::uint64_t random_number() {
  std::uint64_t number = 0;
  randombytes_buf(&number, sizeof number);
  return number;
}

}  // namespace

LaneSocket::LaneSocket(Gateway& gateway, Upstream& daemon, Transport transport, Known known,
                       Shares::Place lane, Shares::Place connection)
    : gateway_(gateway),
      daemon_(daemon),
      known_(std::move(known)),
      lane_(std::move(lane)),
      connection_(std::move(connection)),
      socket_(std::move(transport)),
      state_(random_number) {}

void LaneSocket::start(Head head) {
  gateway_.enter(shared_from_this());
  head_ = std::move(head);
  // Only to give back what a page holds that vanished without a word: no axis waits for it.
  socket_.set_option(websocket::stream_base::timeout{.handshake_timeout = std::chrono::seconds(5),
                                                     .idle_timeout = std::chrono::seconds(20),
                                                     .keep_alive_pings = true});
  socket_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(beast::http::field::sec_websocket_protocol,
                 beast::string_view(lane_protocol.data(), lane_protocol.size()));
  }));
  socket_.read_message_max(largest_lane_message);
  socket_.binary(true);
  socket_.async_accept(head_, [self = shared_from_this()](ErrorCode error) {
    if (self->closed_) return;
    if (error) return self->lost();
    self->read();
  });
}

void LaneSocket::read() {
  socket_.async_read(buffer_, [self = shared_from_this()](ErrorCode error, std::size_t) {
    if (error) return self->lost();
    if (self->closed_) return;
    if (!self->socket_.got_binary()) return self->shut("messages are binary");
    const auto bytes = self->buffer_.cdata();
    self->take({static_cast<const char*>(bytes.data()), bytes.size()});
    self->buffer_.clear();
    if (!self->closed_) self->read();
  });
}

void LaneSocket::take(std::string_view bytes) {
  const auto now = gateway_.clock.now();
  const auto request = parse_lane_request(bytes);
  if (request && !request->method.empty()) gateway_.sessions.touch(known_.session, now);
  carry_out(state_.receive(bytes, now));
}

void LaneSocket::carry_out(const LaneEffects& effects) {
  for (const auto& effect : effects) {
    if (const auto* call = std::get_if<LaneCall>(&effect))
      ask(*call);
    else if (const auto* bytes = std::get_if<LaneSend>(&effect))
      send(bytes->bytes);
    else if (const auto* end = std::get_if<LaneClose>(&effect))
      shut(end->why);
  }
  watch_time();
}

void LaneSocket::ask(const LaneCall& call) {
  daemon_.ask(call.method, call.message, known_.person, call.patience,
              [self = shared_from_this(), number = call.number](const CallStatus& status,
                                                                const std::string& response) {
                self->carry_out(self->state_.answered(number, status, response, self->gateway_.clock.now()));
              });
}

void LaneSocket::watch_time() {
  const auto due = state_.next_due();
  if (due == TimePoint::max())
    timer_.reset();
  else
    timer_ = gateway_.clock.call_at(
        due, [self = shared_from_this()] { self->carry_out(self->state_.pass(self->gateway_.clock.now())); });
}

void LaneSocket::send(std::string bytes) {
  if (closed_) return;
  out_size_ += bytes.size();
  out_.push_back(std::move(bytes));
  if (out_size_ > most_out) return lost();  // nobody reads them
  if (out_.size() == 1) write();
}

void LaneSocket::write() {
  socket_.async_write(boost::asio::buffer(out_.front()),
                      [self = shared_from_this()](ErrorCode error, std::size_t) {
                        if (error) return self->lost();
                        self->out_size_ -= self->out_.front().size();
                        self->out_.pop_front();
                        if (!self->out_.empty() && !self->closed_) self->write();
                      });
}

void LaneSocket::shut(std::string_view why) {
  if (std::exchange(closed_, true)) return;
  carry_out(state_.close(gateway_.clock.now()));
  if (gateway_.may_tell()) spdlog::info("the lane of {} ends: {}", known_.person.name, why);
  end_ = gateway_.clock.call_at(gateway_.clock.now() + goodbye,
                                [self = shared_from_this()] { self->socket_.next_layer().close(); });
  if (!socket_.is_open()) return socket_.next_layer().close();
  socket_.async_close({websocket::close_code::policy_error, beast::string_view(why.data(), why.size())},
                      [self = shared_from_this()](ErrorCode) {
                        self->end_.reset();
                        self->socket_.next_layer().close();
                      });
}

void LaneSocket::lost() {
  if (!std::exchange(closed_, true)) carry_out(state_.close(gateway_.clock.now()));
  end_.reset();
  socket_.next_layer().close();
}

}  // namespace axisd::web
