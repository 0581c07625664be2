#include "tests/support/virtual_line.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>

namespace axisd::test {

using namespace modbus_rtu;

VirtualLine::VirtualLine(VirtualWorld& world, LineSettings settings)
    : world_(&world),
      settings_(std::move(settings)),
      serial_(settings_.serial()),
      network_({.baud = settings_.baud, .bits_per_character = settings_.format.bits_per_character()}) {
  network_.set_serial({.baud = serial_.baud, .format = serial_.format});
}

void VirtualLine::start(ResultHandler on_result, PortHandler on_port) {
  on_result_ = std::move(on_result);
  on_port_ = std::move(on_port);
  set_open(open_);
}

void VirtualLine::set_open(bool open) {
  open_ = open;
  if (!on_port_) return;
  post(world_->executor(), [this, open] {
    PortStatus status{.open = open};
    if (!open) status.error = Error{.reason = Reason::bus_down, .message = "unplugged"};
    on_port_(status);
    if (open) return;
    if (armed_ != nullptr) {
      result_ = {};
      end(ExchangeStatus::not_sent);
    }
    if (under_way_ != nullptr) end(ExchangeStatus::io_error);
  });
}

void VirtualLine::arm(const Exchange& exchange) {
  armed_ = &exchange;
  revoked_ = cut_wanted_ = false;
  await_bind();
}

void VirtualLine::await_bind() {
  timer_ = world_->clock().call_at(earliest_begin(), [this] { bind(); });
}

/// Of what is armed: silent for as long as the last bytes and its own require.
TimePoint VirtualLine::earliest_begin() const {
  const auto next = armed_->serial.value_or(settings_.serial());
  return std::max(world_->now(), quiet_since_ + std::max(silence(serial_), silence(next)));
}

bool VirtualLine::use(const SerialSettings& serial) {
  if (serial == serial_) return true;
  if (can_do_ && !can_do_(serial)) return false;
  serial_ = serial;
  network_.set_serial({.baud = serial.baud, .format = serial.format});
  return true;
}

std::optional<std::span<const ExchangeResult>> VirtualLine::revoke() {
  revoked_ = true;
  if (armed_ == nullptr) return std::nullopt;
  armed_ = nullptr;
  timer_.reset();
  told_ = std::exchange(results_, {});
  return told_;
}

void VirtualLine::bind() {
  const auto now = world_->now();
  const auto& exchange = *armed_;
  result_ = {};
  result_.request_begin = result_.request_end = now;
  if (!use(exchange.serial.value_or(settings_.serial()))) return end(ExchangeStatus::unsupported);
  if (exchange.deadline < now) return end(ExchangeStatus::not_sent, Verdict::expired);
  if (const auto verdict = may_send(exchange.guard, now); verdict != Verdict::send)
    return end(ExchangeStatus::not_sent, verdict);
  armed_ = nullptr;
  under_way_ = &exchange;
  result_.request_end = now + wire_time(serial_, exchange.frame.size());
  const auto bytes = exchange.frame.bytes();
  wire_.push_back({.begin = now,
                   .end = result_.request_end,
                   .request = {bytes.begin(), bytes.end()},
                   .status = ExchangeStatus::timeout,
                   .serial = serial_});
  if (on_bind_) on_bind_(wire_.back());
  timer_ = world_->clock().call_at(result_.request_end, [this] { request_sent(); });
}

void VirtualLine::request_sent() {
  const auto& exchange = *under_way_;
  network_.advance(world_->now());
  auto reply = network_.on_request(exchange.frame.bytes(), result_.request_end);
  if (network_.take_hang_up()) return set_open(false);
  if (reply) {
    // A node, and the adapter too, delivers in order: nothing overtakes a reply that is late.
    const auto shift = std::max(Duration{}, last_reply_end_ + silence(serial_) - reply->begin);
    reply->begin += shift;
    last_reply_end_ = reply->end += shift;
  }
  const auto latest = result_.request_end + exchange.reply_timeout;
  timer_ = world_->clock().call_at(latest, [this] { end(ExchangeStatus::timeout); });
  if (cut_wanted_) await_cut();
  if (!reply) return;
  const std::span<const std::uint8_t> bytes = reply->bytes;
  const auto first = bytes.size() - reply->repeated;
  const auto first_end = reply->end - (reply->arrivals.back() - reply->arrivals.at(first - 1));
  if (first_end <= latest) {
    reply_coming_ = true;
    result_.reply_begin = reply->begin;
  }
  // What follows within the silence keeps the line busy until its own end.
  arrive(first_end, bytes.first(first), reply->end);
  if (reply->repeated > 0) arrive(reply->end, bytes.subspan(first), reply->end);
}

void VirtualLine::arrive(TimePoint when, std::span<const std::uint8_t> bytes, TimePoint busy_until) {
  const auto id = ++last_arrival_;
  auto arrived = [this, id, busy_until, copy = std::vector(bytes.begin(), bytes.end())] {
    // The timer lives as long as its callback runs.
    const auto timer = std::move(arrivals_.extract(id).mapped());
    quiet_since_ = std::max(quiet_since_, busy_until);
    hear(copy);
  };
  arrivals_[id] = world_->clock().call_at(when, std::move(arrived));
}

void VirtualLine::hear(std::span<const std::uint8_t> bytes) {
  quiet_since_ = std::max(quiet_since_, world_->now());
  if (armed_ != nullptr) {  // the silence begins anew
    await_bind();
    return;
  }
  // Bytes that arrive while the request is being sent are lost with it.
  if (under_way_ == nullptr || world_->now() < result_.request_end) return;
  // The reply proper comes last; an echo or a foreign frame may stand before it.
  Reply best;
  auto proper = bytes;
  for (std::size_t skip = 0;
       skip < bytes.size() && best.kind != ReplyKind::match && best.kind != ReplyKind::exception; ++skip)
    if (const auto decoded = decode(under_way_->request, bytes.subspan(skip));
        decoded.kind != ReplyKind::corrupt) {
      best = decoded;
      proper = bytes.subspan(skip);
    }
  if (best.kind == ReplyKind::foreign) {
    ++result_.foreign_frames;
    reply_coming_ = false;
    return;
  }
  const bool answered = best.kind == ReplyKind::match || best.kind == ReplyKind::exception;
  result_.reply = best;
  result_.reply_frame = Frame(proper.first(std::min(proper.size(), Frame::capacity)));
  end(answered ? ExchangeStatus::replied : ExchangeStatus::corrupt);
}

/// As the worker: what is armed is cut, too, when its time has come.
void VirtualLine::cut_wait() {
  if (std::exchange(cut_wanted_, true)) return;
  if (under_way_ != nullptr && world_->now() >= result_.request_end) await_cut();
}

void VirtualLine::await_cut() {
  const auto when = std::max(world_->now(), result_.request_end + under_way_->turnaround_max);
  cut_timer_ = world_->clock().call_at(when, [this] {
    if (under_way_ != nullptr && !reply_has_begun()) end(ExchangeStatus::cut);
  });
}

bool VirtualLine::reply_has_begun() const { return reply_coming_ && result_.reply_begin <= world_->now(); }

void VirtualLine::end(ExchangeStatus status, Verdict verdict) {
  timer_.reset();
  cut_timer_.reset();
  result_.status = status;
  result_.verdict = verdict;
  result_.reply_end = world_->now();
  if (status == ExchangeStatus::io_error) result_.native_error = EIO;
  if (under_way_ != nullptr) {
    if (!wire_.empty()) {
      wire_.back().status = status;
      wire_.back().end = world_->now();
    }
    quiet_since_ = std::max(quiet_since_, world_->now());
  }
  const auto& ended = *std::exchange(under_way_ != nullptr ? under_way_ : armed_, nullptr);
  reply_coming_ = false;
  results_.push_back(result_);
  if (round_goes_on(ended, results_) && !revoked_) {
    armed_ = ended.then;
    return await_bind();
  }
  post(world_->executor(), [this, results = std::exchange(results_, {})] { on_result_(results); });
}

}  // namespace axisd::test
