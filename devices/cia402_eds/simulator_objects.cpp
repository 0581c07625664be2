// What the objects of the simulated standard drive say, and what writing them does.
#include <algorithm>
#include <cmath>
#include <limits>

#include "devices/cia402_eds/simulator.hpp"

namespace axisd::cia402_eds {

namespace abort_code = simulation::abort_code;
using simulation::ObjectRow;

namespace {

/// CiA 301 7.5.2.13, 7.5.2.14: "save" and "load", low byte first; anything else is refused.
constexpr std::int64_t save_signature = 0x65766173, load_signature = 0x64616F6C;
constexpr std::uint32_t cannot_store = 0x08000020;

}  // namespace

simulation::CanopenHooks StandardDrive::hooks() {
  return {.read = [this](const ObjectRow& row) { return read(row); },
          .write = [this](const ObjectRow& row, std::int64_t value,
                          bool& store) { return write(row, value, store); },
          .written = [this](const ObjectRow& row) { written(row); },
          .saves = [](const ObjectRow&) { return false; },  // on command only: 1010h
          .changing =
              [this] {
                return motor().moving() || shaft_.encoder().wavers(motor()) ||
                       behaviour_.velocity_wavers_at_rest;
              }};
}

std::optional<std::int64_t> StandardDrive::read(const ObjectRow& row) const {
  switch (row.index) {
    case 0x603F:
      return fault_.told();
    case 0x6041:
      return status();
    case 0x6061:
      return control_.mode();
    case 0x6062:
      return motor().counter();
    case 0x6064:
      return shaft_.measured(now_);
    case 0x606C:
      return velocity();
    case 0x60F4:
      return shaft_.encoder().deviation(motor(), now_);
    case 0x60FD:
      return inputs_.bits();
    default:
      return std::nullopt;
  }
}

/// 606Ch: measured.
std::int64_t StandardDrive::velocity() const {
  constexpr double minute = 60, most_noise = 30, most = std::numeric_limits<std::int32_t>::max();
  const auto& meter = behaviour_.velocity_wavers_at_rest ? tachometer_ : shaft_.encoder();
  const auto& units = objects_.units();
  const auto per_second = motor().shaft_speed() * (units.position / units.velocity);
  auto amount = 1 / minute / units.velocity;
  if (behaviour_.velocity_wavers_by_threshold)
    amount = std::clamp(static_cast<double>(dictionary_.get(0x606F)), amount, most_noise * amount);
  const auto noise = meter.velocity_noise(now_) * amount;
  return std::llround(std::clamp(per_second + noise, -most, most));
}

/// By 6502h where it says anything, and by the objects that the mode works with: profile position, profile
/// velocity and homing are simulated.
bool StandardDrive::supports(std::int64_t mode) const {
  if (mode < 1 || mode > 6) return false;
  if (const auto modes = dictionary_.get(0x6502); modes != 0 && (modes >> (mode - 1) & 1) == 0) return false;
  switch (mode) {
    case 1:
      return objects_.has(0x607A) && objects_.has(0x6081);
    case 3:
      return objects_.has(0x60FF);
    case 6:
      return objects_.has(0x6098);
    default:
      return false;
  }
}

std::uint32_t StandardDrive::write(const ObjectRow& row, std::int64_t value, bool& store) {
  switch (row.index) {
    case 0x1010:
    case 0x1011:
      store = false;
      if (value != (row.index == 0x1010 ? save_signature : load_signature)) return cannot_store;
      if (energised()) return abort_code::device_state;
      if (row.index == 0x1010)
        dictionary_.save_all();
      else
        load_defaults_ = true;  // valid with the next reset (CiA 301 7.5.2.14)
      return abort_code::none;
    case 0x1003:  // 7.5.2.4: it is only cleared
      return row.sub == 0 && value != 0 ? abort_code::value : abort_code::none;
    case 0x605A:  // not the current and the voltage limit, nor what is a maker's own
      return value < 0 || value > 6 || value == 3 || value == 4 ? abort_code::value : abort_code::none;
    case 0x6060:
      return value == 0 || supports(value) ? abort_code::none : abort_code::value;
    case 0x6098:
      return Homing::knows(value) ? abort_code::none : abort_code::value;
    default:
      return abort_code::none;
  }
}

void StandardDrive::written(const ObjectRow& row) {
  if (row.index == 0x6040) control(static_cast<std::uint16_t>(dictionary_.get(0x6040)));
  if (row.index == 0x6060) set_mode(static_cast<int>(dictionary_.get(0x6060)));
  if (row.index == 0x60FF) velocity_.release();
  if (says_rates(row.index)) objects_.set_units(units_of(dictionary_, settings_.units));
}

}  // namespace axisd::cia402_eds
