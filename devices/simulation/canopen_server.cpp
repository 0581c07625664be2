#include "devices/simulation/canopen_server.hpp"

#include <algorithm>

namespace axisd::simulation {

namespace {

constexpr std::uint16_t error_register_index = 0x1001, error_history = 0x1003, sync_cob = 0x1005,
                        emergency_index = 0x1014, heartbeat_index = 0x1017, sdo_index = 0x1200;
constexpr std::uint32_t sdo_request = 0x600, sdo_reply = 0x580, heartbeat_id = 0x700;
constexpr std::uint32_t produces_sync = 0x40000000, extended_id = 0x20000000, disabled = 0x80000000;

}  // namespace

void add_communication_rows(CanopenDictionary& dictionary, const CanopenIdentity& identity) {
  const auto number = [&](std::uint16_t index, int sub, std::uint8_t size, Access access,
                          std::int64_t value) {
    dictionary.add({.index = index,
                    .sub = static_cast<std::uint8_t>(sub),
                    .size = size,
                    .access = access,
                    .maximum = size == 4   ? 0xFFFFFFFF
                               : size == 2 ? 0xFFFF
                                           : 0xFF,
                    .default_value = value});
  };
  number(0x1000, 0, 4, Access::ro, identity.device_type);
  number(error_register_index, 0, 1, Access::ro, 0);
  number(error_history, 0, 1, Access::ro, identity.errors);
  for (int i = 1; i <= identity.errors; ++i) number(error_history, i, 4, Access::ro, 0);
  number(sync_cob, 0, 4, Access::rw, 0x80);
  number(emergency_index, 0, 4, Access::rw, 0);  // 0: what the node-ID makes it
  number(heartbeat_index, 0, 2, Access::rw_saved, 0);
  number(0x1018, 0, 1, Access::ro, identity.entries);
  const std::array<std::uint32_t, 4> values{identity.vendor, identity.product, identity.revision, 0};
  for (int i = 1; i <= identity.entries; ++i)
    number(0x1018, i, 4, Access::ro, values.at(static_cast<std::size_t>(i - 1)));
  number(sdo_index, 0, 1, Access::ro, 2);
  number(sdo_index, 1, 4, Access::ro, 0);
  number(sdo_index, 2, 4, Access::ro, 0);
}

CanopenServer::CanopenServer(const CanopenServerSettings& settings, CanopenDictionary& dictionary,
                             CanopenHooks hooks, std::function<void(bool)> reset)
    : settings_(settings),
      dictionary_(&dictionary),
      device_(std::move(hooks)),
      reset_(std::move(reset)),
      objects_(dictionary, wrap(device_)),
      pdos_(settings.pdos, objects_, [this](const can::Frame& frame) { send(frame); }),
      sdo_(settings.sdo) {}

CanopenHooks CanopenServer::wrap(CanopenHooks hooks) {
  hooks.read = [this](const ObjectRow& row) -> std::optional<std::int64_t> {
    if (row.index == emergency_index) return emergency_cob();
    return device_.read ? device_.read(row) : std::nullopt;
  };
  hooks.write = [this](const ObjectRow& row, std::int64_t value, bool& store) {
    const auto refused = check_write(row, value);
    return refused != abort_code::none || !device_.write ? refused : device_.write(row, value, store);
  };
  hooks.written = [this](const ObjectRow& row) {
    written(row);
    if (device_.written) device_.written(row);
  };
  return hooks;
}

std::uint32_t CanopenServer::check_write(const ObjectRow& row, std::int64_t value) const {
  const auto bits = static_cast<std::uint32_t>(value);
  if (row.index >= 0x1400 && row.index < 0x1C00) return pdos_.check_write(row, value);
  // No node here produces SYNC, and none has 29-bit identifiers.
  if (row.index == sync_cob && (bits & (produces_sync | extended_id)) != 0) return abort_code::value;
  if (row.index == emergency_index && ((bits & extended_id) != 0 || (bits & 0x7FFU) == 0))
    return abort_code::value;
  return abort_code::none;
}

void CanopenServer::written(const ObjectRow& row) {
  if (row.index >= 0x1400 && row.index < 0x1C00) pdos_.written(row);
  if (row.index == heartbeat_index)
    heartbeat_ = heartbeat_time() > Duration{} ? now_ + heartbeat_time() : TimePoint::max();
}

Duration CanopenServer::heartbeat_time() const {
  return std::chrono::milliseconds(dictionary_->get(heartbeat_index));
}

std::uint32_t CanopenServer::emergency_cob() const {
  const auto written = static_cast<std::uint32_t>(dictionary_->get(emergency_index));
  if (written != 0) return written;
  return settings_.emergency_base + (settings_.emergency_base_alone ? 0U : node_);
}

void CanopenServer::begin(std::uint8_t node) {
  node_ = node;
  sdo_.reset();
  replies_.clear();
  out_.clear();
  heartbeat_ = TimePoint::max();
  pdos_.set_operational(false, now_);
  pdos_.forget_received();
  dictionary_->set(sdo_index, 1, sdo_request + node);
  dictionary_->set(sdo_index, 2, sdo_reply + node);
  if (settings_.error_count_grows) dictionary_->set(error_history, 0, 0);
  pdos_.boot(node);
}

void CanopenServer::boot(std::uint8_t node, TimePoint ready) {
  begin(node);
  state_ = NmtState::booting;
  ready_ = ready;
}

void CanopenServer::boot_quietly(std::uint8_t node, TimePoint now) {
  begin(node);
  ready_ = TimePoint::max();
  set_state(NmtState::pre_operational, now);
  if (heartbeat_time() > Duration{}) heartbeat_ = now + heartbeat_time();
}

void CanopenServer::switch_off() {
  begin(node_);
  state_ = NmtState::off;
  ready_ = TimePoint::max();
}

void CanopenServer::set_state(NmtState state, TimePoint now) {
  state_ = state;
  pdos_.set_operational(state == NmtState::operational, now);
}

bool CanopenServer::hears(const can::Frame& frame) const {
  if (!alive() || frame.extended || frame.rtr) return false;
  const auto sync = static_cast<std::uint32_t>(dictionary_->get(sync_cob) & 0x7FF);
  return frame.id == 0 || frame.id == sync || frame.id == sdo_request + node_ || pdos_.hears(frame.id);
}

void CanopenServer::on_frame(const can::Frame& frame, TimePoint now) {
  now_ = now;
  if (!hears(frame)) return;
  if (frame.id == 0) {
    if (frame.size >= 2 && (frame.data[1] == 0 || frame.data[1] == node_)) on_nmt(frame.data[0], now);
  } else if (frame.id == sdo_request + node_) {
    if (frame.size != 8 || state_ == NmtState::stopped) return;
    const auto answer = sdo_.on_request(frame.data, objects_);
    if (answer)
      replies_.emplace_back(now + settings_.reply_latency, can::make_frame(sdo_reply + node_, *answer));
  } else if (!pdos_.on_frame(frame)) {
    pdos_.on_sync(now);
  }
  pdos_.touch(now);
}

void CanopenServer::on_nmt(std::uint8_t command, TimePoint now) {
  switch (command) {
    case 0x01:
      if (state_ != NmtState::operational) set_state(NmtState::operational, now);
      break;
    case 0x02:
      set_state(NmtState::stopped, now);
      sdo_.reset();
      break;
    case 0x80:
      set_state(NmtState::pre_operational, now);
      break;
    case 0x81:
    case 0x82:
      reset_(command == 0x82);
      break;
    default:
      break;
  }
}

void CanopenServer::send_heartbeat(TimePoint now) {
  if (heartbeat_time() == Duration{}) {  // the factory settings were restored meanwhile
    heartbeat_ = TimePoint::max();
    return;
  }
  const std::uint8_t code = state_ == NmtState::operational ? 0x05
                            : state_ == NmtState::stopped   ? 0x04
                                                            : 0x7F;
  send(can::make_frame(heartbeat_id + node_, std::array{code}));
  heartbeat_ = std::max(heartbeat_ + heartbeat_time(), now);
}

void CanopenServer::advance(TimePoint now) {
  now_ = now;
  if (state_ == NmtState::booting && now >= ready_) {
    ready_ = TimePoint::max();
    set_state(NmtState::pre_operational, now);
    if (node_ != 0) send(can::make_frame(heartbeat_id + node_, std::array<std::uint8_t, 1>{0}));
    if (heartbeat_time() > Duration{}) heartbeat_ = now + heartbeat_time();
  }
  if (!alive()) return;
  while (!replies_.empty() && replies_.front().first <= now) {
    send(replies_.front().second);
    replies_.pop_front();
  }
  if (heartbeat_ <= now) send_heartbeat(now);
  pdos_.advance(now);
}

TimePoint CanopenServer::next_event() const {
  if (state_ == NmtState::booting) return ready_;
  if (!alive()) return TimePoint::max();
  const auto reply = replies_.empty() ? TimePoint::max() : replies_.front().first;
  return std::min({reply, heartbeat_, pdos_.next_event()});
}

std::optional<can::Frame> CanopenServer::take_frame() {
  if (out_.empty()) return std::nullopt;
  const auto frame = out_.front();
  out_.pop_front();
  return frame;
}

void CanopenServer::emergency(std::uint16_t code, std::uint8_t error_register,
                              std::array<std::uint8_t, 5> vendor) {
  dictionary_->set(error_register_index, 0, error_register);
  if (code != 0) {
    constexpr std::uint8_t most = 254;  // CiA 301 7.5.2.4
    std::uint8_t last = 0;
    while (last < most && dictionary_->find(error_history, static_cast<std::uint8_t>(last + 1)) != nullptr)
      ++last;
    for (auto sub = last; sub > 1; --sub)
      dictionary_->set(error_history, sub,
                       dictionary_->get(error_history, static_cast<std::uint8_t>(sub - 1)));
    dictionary_->set(error_history, 1, code);
    if (settings_.error_count_grows)
      dictionary_->set(error_history, 0, std::min<std::int64_t>(dictionary_->get(error_history) + 1, last));
  }
  const auto cob = emergency_cob();
  if (!alive() || state_ == NmtState::stopped || (cob & disabled) != 0) return;
  std::array<std::uint8_t, 8> bytes{static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8U),
                                    error_register};
  std::ranges::copy(vendor, bytes.begin() + 3);
  send(can::make_frame(cob & 0x7FFU, bytes));
}

}  // namespace axisd::simulation
