#include "devices/cia402/state_link.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace axisd::cia402 {

namespace {

constexpr int missed_in_a_row = 3;

std::string by_sdo_because(const std::string& why) { return "state by SDO polling: " + why; }

}  // namespace

void StateWay::refuse(const std::string& why) {
  state_ = State::by_sdo;
  note_ = by_sdo_because(why);
}

void StateWay::expect() {
  state_ = State::by_pdo;
  missed_ = 0;
  note_.clear();
}

void StateWay::came() {
  if (state_ != State::by_sdo) expect();
}

void StateWay::miss() {
  if (state_ == State::by_pdo && ++missed_ >= missed_in_a_row) state_ = State::missing;
}

void StateWay::polled() {
  if (state_ != State::missing) return;
  state_ = State::replaced;
  note_ = by_sdo_because("its TPDOs do not come");
}

bool StateLink::listen(const Model& model, std::vector<canopen::PdoMapping> layout,
                       std::span<const std::uint32_t> ids, bool synchronous) {
  close();
  pdos_.begin(model, std::move(layout), synchronous);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto taken = bus_->master().subscribe_pdo(
        ids[i], [this, i](const can::ReceivedFrame& received) { on_pdo(i, received); });
    if (!taken) {
      close();
      return false;
    }
    subscribed_.push_back(ids[i]);
  }
  if (synchronous) sync_ = bus_->on_sync([this](TimePoint at) { pdos_.on_sync(at); });
  return true;
}

void StateLink::close() {
  for (const auto id : subscribed_) (void)bus_->master().subscribe_pdo(id, {});
  subscribed_.clear();
  sync_.reset();
  pdos_ = {};
}

bool StateLink::can_come() const {
  return !subscribed_.empty() && (!pdos_.synchronous() || bus_->sync_running());
}

void StateLink::on_pdo(std::size_t index, const can::ReceivedFrame& received) {
  const auto bits = can::worst_case_bits(received.frame);
  const auto on_wire = std::chrono::nanoseconds(std::chrono::seconds(1)) * bits /
                       std::max<std::uint32_t>(bus_->settings().bitrate, 1);
  if (pdos_.on_pdo(index, received.frame.bytes(), received.at - on_wire, received.at)) news_->notify_all();
}

}  // namespace axisd::cia402
