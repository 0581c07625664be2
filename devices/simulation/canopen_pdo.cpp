#include "devices/simulation/canopen_pdo.hpp"

#include <algorithm>
#include <utility>

namespace axisd::simulation {

namespace {

constexpr std::uint16_t receive_parameters = 0x1400, receive_mapping = 0x1600, transmit_parameters = 0x1800,
                        transmit_mapping = 0x1A00;
constexpr std::uint32_t invalid = 0x80000000;
constexpr std::int64_t last_synchronous = 240, first_event_driven = 254;  // transmission types
/// A drive looks at its objects in its own cycle, not at each pulse; the manuals give no figure.
constexpr Duration cycle = std::chrono::milliseconds(1);

bool is_mapping(std::uint16_t index) {
  return (index >= receive_mapping && index < transmit_parameters) ||
         (index >= transmit_mapping && index < 0x1C00);
}

struct Entry {
  std::uint16_t index;
  std::uint8_t sub;
  unsigned bytes;
  explicit Entry(std::int64_t value)
      : index(static_cast<std::uint16_t>(value >> 16)),
        sub(static_cast<std::uint8_t>(value >> 8)),
        bytes((static_cast<unsigned>(value) & 0xFFU) / 8) {}
};

/// A PDO whose COB-ID is this is there. 0, as of an object that does not exist, is NMT's.
bool is_valid(std::int64_t cob) {
  const auto bits = static_cast<std::uint32_t>(cob);
  return (bits & invalid) == 0 && (bits & 0x7FFU) != 0;
}

std::uint16_t at(std::uint16_t first, int number) { return static_cast<std::uint16_t>(first + number); }

void add_one(CanopenDictionary& dictionary, const PdoSettings& settings, std::uint16_t parameters,
             std::uint16_t mapping) {
  const auto identifier = settings.read_only ? Access::ro : Access::rw;
  const auto row = [&](std::uint16_t index, int sub, std::uint8_t size, Access access, std::int64_t maximum,
                       std::int64_t value) {
    dictionary.add({.index = index,
                    .sub = static_cast<std::uint8_t>(sub),
                    .size = size,
                    .access = access,
                    .maximum = maximum,
                    .default_value = value});
  };
  row(parameters, 0, 1, Access::ro, 0, 5);
  row(parameters, 1, 4, identifier, 0xFFFFFFFF, 0);
  row(parameters, 2, 1, Access::rw_saved, 255, 255);
  row(parameters, 3, 2, Access::rw_saved, 65535, 0);
  row(parameters, 4, 1, Access::rw, 255, 0);
  row(parameters, 5, 2, Access::rw_saved, 65535, 0);
  row(mapping, 0, 1, identifier, settings.entries, 0);
  for (int sub = 1; sub <= settings.entries; ++sub) row(mapping, sub, 4, Access::rw_saved, 0xFFFFFFFF, 0);
}

}  // namespace

void add_pdo_rows(CanopenDictionary& dictionary, const PdoSettings& settings) {
  for (int i = 0; i < settings.rpdos; ++i)
    add_one(dictionary, settings, at(receive_parameters, i), at(receive_mapping, i));
  for (int i = 0; i < settings.tpdos; ++i)
    add_one(dictionary, settings, at(transmit_parameters, i), at(transmit_mapping, i));
}

CanopenPdos::CanopenPdos(const PdoSettings& settings, CanopenObjects& objects, Send send)
    : settings_(settings),
      objects_(&objects),
      send_(std::move(send)),
      tpdos_(static_cast<std::size_t>(settings.tpdos)),
      held_(static_cast<std::size_t>(settings.rpdos)) {}

void CanopenPdos::boot(std::uint8_t node) {
  if (settings_.from_dictionary) return;
  auto& dictionary = objects_->dictionary();
  for (int i = 0; i < settings_.rpdos; ++i) {
    dictionary.set(at(receive_parameters, i), 1, 0x200 + 0x100 * i + node);
    follow_entries(at(receive_mapping, i));
  }
  for (int i = 0; i < settings_.tpdos; ++i) {
    dictionary.set(at(transmit_parameters, i), 1, 0x180 + 0x100 * i + node);
    follow_entries(at(transmit_mapping, i));
  }
}

std::int64_t CanopenPdos::parameter(std::uint16_t first, int number, std::uint8_t sub) const {
  return objects_->dictionary().get(at(first, number), sub);
}

std::uint32_t CanopenPdos::check_write(const ObjectRow& row, std::int64_t value) const {
  if (is_mapping(row.index))
    return row.sub == 0 ? check_count(row.index, value) : check_entry(row.index, row.sub, value);
  if (row.sub == 1) {
    const auto now = static_cast<std::uint32_t>(objects_->dictionary().get(row.index, 1));
    const auto wanted = static_cast<std::uint32_t>(value);
    // 7.5.2.35: the identifier does not change while the PDO exists.
    const bool changes = (now & 0x7FFU) != (wanted & 0x7FFU) && (wanted & invalid) == 0;
    return changes && (now & invalid) == 0 ? abort_code::value : abort_code::none;
  }
  if (row.sub != 2) return abort_code::none;
  if (value > last_synchronous && value < first_event_driven)
    return abort_code::value;  // reserved, or by remote request
  const bool receives = row.index < receive_mapping;
  if (receives && settings_.reception.refused && value <= last_synchronous) return abort_code::value;
  return abort_code::none;
}

std::uint32_t CanopenPdos::check_entry(std::uint16_t index, std::uint8_t sub, std::int64_t value) const {
  auto& dictionary = objects_->dictionary();
  if (!settings_.read_only && dictionary.get(index) != 0) return abort_code::device_state;
  if (value == 0) return abort_code::none;
  const Entry entry(value);
  const auto* row = dictionary.find(entry.index, entry.sub);
  if (row == nullptr) return abort_code::no_object;
  const bool receives = index < transmit_parameters;
  const bool fits = receives ? row->access != Access::ro : row->access != Access::wo;
  if (!row->mappable || !fits || entry.bytes != row->size) return abort_code::not_mappable;
  if (!settings_.read_only) return abort_code::none;  // counted when the number is written
  unsigned total = entry.bytes;
  for (int other = 1; other <= settings_.entries; ++other)
    if (other != sub) total += Entry(dictionary.get(index, static_cast<std::uint8_t>(other))).bytes;
  return total > 8 ? abort_code::pdo_length : abort_code::none;
}

std::uint32_t CanopenPdos::check_count(std::uint16_t index, std::int64_t count) const {
  unsigned total = 0;
  for (int sub = 1; sub <= count; ++sub) {
    const auto value = objects_->dictionary().get(index, static_cast<std::uint8_t>(sub));
    if (value == 0) return abort_code::no_object;
    total += Entry(value).bytes;
  }
  return total > 8 ? abort_code::pdo_length : abort_code::none;
}

void CanopenPdos::follow_entries(std::uint16_t index) {
  auto& dictionary = objects_->dictionary();
  int count = 0;
  while (count < settings_.entries && dictionary.get(index, static_cast<std::uint8_t>(count + 1)) != 0)
    ++count;
  dictionary.set(index, 0, count);
}

void CanopenPdos::written(const ObjectRow& row) {
  if (is_mapping(row.index) && row.sub != 0 && settings_.read_only) follow_entries(row.index);
  if (row.index < receive_mapping && row.sub == 2 && settings_.reception.applied_by_type) {
    const auto number = row.index & 0xFF;
    if (!waits_for_sync(number))
      if (const auto bytes = std::exchange(held_.at(static_cast<std::size_t>(number)), std::nullopt))
        apply(number, *bytes);
  }
  if (row.index < transmit_parameters || row.index >= 0x1C00) return;
  auto& pdo = tpdos_.at(row.index & 0xFFU);
  pdo.sent.reset();  // another PDO from now on
  pdo.syncs = 0;
  pdo.timer = TimePoint::max();
  if (operational_) start_timer(row.index & 0xFF, looked_);
}

void CanopenPdos::forget_received() { held_.assign(held_.size(), std::nullopt); }

void CanopenPdos::set_operational(bool operational, TimePoint now) {
  operational_ = operational;
  if (!settings_.reception.kept) forget_received();
  tpdos_.assign(tpdos_.size(), {});
  look_due_ = TimePoint::max();
  if (!operational) return;
  for (int i = 0; i < settings_.tpdos; ++i) start_timer(i, now);
  touch(now);
}

bool CanopenPdos::listens(int number) const {
  return is_valid(parameter(receive_parameters, number, 1)) && parameter(receive_mapping, number, 0) > 0;
}

bool CanopenPdos::transmits(int number) const {
  return operational_ && is_valid(parameter(transmit_parameters, number, 1)) &&
         parameter(transmit_mapping, number, 0) > 0;
}

bool CanopenPdos::by_event(int number) const {
  return transmits(number) && parameter(transmit_parameters, number, 2) >= first_event_driven;
}

bool CanopenPdos::hears(std::uint32_t id) const {
  if (!operational_) return false;
  for (int i = 0; i < settings_.rpdos; ++i)
    if (static_cast<std::uint32_t>(parameter(receive_parameters, i, 1) & 0x7FF) == id && listens(i))
      return true;
  return false;
}

bool CanopenPdos::on_frame(const can::Frame& frame) {
  if (!operational_) return false;
  bool mine = false;
  for (int i = 0; i < settings_.rpdos; ++i) {
    if (static_cast<std::uint32_t>(parameter(receive_parameters, i, 1) & 0x7FF) != frame.id || !listens(i))
      continue;
    mine = true;
    receive(i, Bytes(frame.bytes().begin(), frame.bytes().end()));
  }
  return mine;
}

bool CanopenPdos::waits_for_sync(int number) const {
  return parameter(receive_parameters, number, 2) <= last_synchronous && !settings_.reception.at_once;
}

/// Each RPDO has one place: what waits there is replaced, and gone when a later one is applied.
void CanopenPdos::receive(int number, Bytes bytes) {
  auto& held = held_.at(static_cast<std::size_t>(number));
  if (!waits_for_sync(number)) {
    held.reset();
    return apply(number, bytes);
  }
  if (!held || !settings_.reception.first_counts) held = std::move(bytes);
}

void CanopenPdos::apply(int number, const Bytes& bytes) {
  std::vector<Entry> entries;
  std::size_t total = 0;
  for (int sub = 1; sub <= parameter(receive_mapping, number, 0); ++sub)
    total += entries.emplace_back(parameter(receive_mapping, number, static_cast<std::uint8_t>(sub))).bytes;
  if (bytes.size() < total) return;  // 7.2.2.5.1: too short is not processed
  auto rest = std::span<const std::uint8_t>(bytes);
  for (const auto& entry : entries) {
    // What the object refuses is not stored; a PDO has no answer.
    objects_->write(entry.index, entry.sub, rest.first(entry.bytes), false);
    rest = rest.subspan(entry.bytes);
  }
}

void CanopenPdos::on_sync(TimePoint now) {
  if (!operational_) return;
  for (int i = 0; i < settings_.rpdos; ++i) {
    auto& held = held_.at(static_cast<std::size_t>(i));
    const auto bytes = settings_.reception.repeated ? held : std::exchange(held, std::nullopt);
    if (bytes) apply(i, *bytes);
  }
  for (int i = 0; i < settings_.tpdos; ++i) {
    const auto type = parameter(transmit_parameters, i, 2);
    if (!transmits(i) || type > last_synchronous) continue;
    auto& pdo = tpdos_.at(static_cast<std::size_t>(i));
    auto bytes = pack(i);
    if (type == 0 ? pdo.sent == bytes : ++pdo.syncs < type) continue;
    pdo.syncs = 0;
    transmit(i, std::move(bytes), now);
  }
}

CanopenPdos::Bytes CanopenPdos::pack(int number) const {
  Bytes bytes;
  for (int sub = 1; sub <= parameter(transmit_mapping, number, 0); ++sub) {
    const Entry entry(parameter(transmit_mapping, number, static_cast<std::uint8_t>(sub)));
    if (bytes.size() + entry.bytes > 8) break;  // of a dictionary that began so
    const auto* row = objects_->dictionary().find(entry.index, entry.sub);
    const auto raw = row == nullptr ? 0U : static_cast<std::uint64_t>(objects_->value(*row));
    for (unsigned i = 0; i < entry.bytes; ++i) bytes.push_back(static_cast<std::uint8_t>(raw >> (8 * i)));
  }
  return bytes;
}

void CanopenPdos::transmit(int number, Bytes bytes, TimePoint now) {
  auto& pdo = tpdos_.at(static_cast<std::size_t>(number));
  const auto inhibit = parameter(transmit_parameters, number, 3);
  pdo.inhibited_until = now + inhibit * std::chrono::microseconds(100);
  send_(
      can::make_frame(static_cast<std::uint32_t>(parameter(transmit_parameters, number, 1) & 0x7FF), bytes));
  pdo.sent = std::move(bytes);
  start_timer(number, now);
}

void CanopenPdos::start_timer(int number, TimePoint now) {
  const auto period = parameter(transmit_parameters, number, 5);
  tpdos_.at(static_cast<std::size_t>(number)).timer =
      period > 0 && by_event(number) ? now + std::chrono::milliseconds(period) : TimePoint::max();
}

void CanopenPdos::touch(TimePoint now) {
  if (operational_) look_due_ = std::min(look_due_, std::max(now, looked_ + cycle));
}

void CanopenPdos::advance(TimePoint now) {
  if (!operational_) return;
  if (look_due_ <= now) look(now);
  for (int i = 0; i < settings_.tpdos; ++i)
    if (tpdos_.at(static_cast<std::size_t>(i)).timer <= now) transmit(i, pack(i), now);
}

void CanopenPdos::look(TimePoint now) {
  looked_ = now;
  look_due_ = TimePoint::max();
  bool any = false;
  for (int i = 0; i < settings_.tpdos; ++i) {
    if (!by_event(i)) continue;
    any = true;
    auto& pdo = tpdos_.at(static_cast<std::size_t>(i));
    auto bytes = pack(i);
    if (pdo.sent == bytes) continue;
    if (pdo.inhibited_until <= now)
      transmit(i, std::move(bytes), now);
    else
      look_due_ = std::min(look_due_, pdo.inhibited_until);
  }
  const auto& changing = objects_->hooks().changing;
  if (any && changing && changing()) look_due_ = std::min(look_due_, now + cycle);
}

TimePoint CanopenPdos::next_event() const {
  if (!operational_) return TimePoint::max();
  auto next = look_due_;
  for (const auto& pdo : tpdos_) next = std::min(next, pdo.timer);
  return next;
}

}  // namespace axisd::simulation
