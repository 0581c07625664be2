// What the objects of the simulated standard drive say, and what writing them does.
#include <cmath>

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
          .changing = [this] { return motor_.moving() || encoder_.wavers(motor_); }};
}

std::optional<std::int64_t> StandardDrive::read(const ObjectRow& row) const {
  switch (row.index) {
    case 0x603F:
      return fault_;
    case 0x6041:
      return status();
    case 0x6061:
      return mode_;
    case 0x6062:
      return motor_.counter();
    case 0x6064:
      return encoder_.position(motor_, now_);
    case 0x606C:
      return velocity();
    case 0x60F4:
      return encoder_.deviation(motor_, now_);
    case 0x60FD:
      return inputs_.bits();
    default:
      return std::nullopt;
  }
}

/// 606Ch: measured, by a motor that takes 1000 increments per revolution.
std::int64_t StandardDrive::velocity() const {
  constexpr double per_rpm = 1000.0 / 60;
  const auto noise = encoder_.velocity_noise(now_) * per_rpm;
  return std::lround(motor_.shaft_speed() + noise);
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
    case 0x605A:
      return value == 3 || value == 4 ? abort_code::value : abort_code::none;  // current and voltage limit
    case 0x6060:
      return value == 0 || value == 1 || value == 3 || value == 6 ? abort_code::none : abort_code::value;
    case 0x6098:
      return value == 0 || value == 35 || find_method(value) != nullptr ? abort_code::none
                                                                        : abort_code::value;
    default:
      return abort_code::none;
  }
}

void StandardDrive::written(const ObjectRow& row) {
  if (row.index == 0x6040) control(static_cast<std::uint16_t>(dictionary_.get(0x6040)));
  if (row.index == 0x6060) set_mode(static_cast<int>(dictionary_.get(0x6060)));
  if (row.index == 0x60FF) velocity_held_ = false;
}

}  // namespace axisd::cia402_eds
