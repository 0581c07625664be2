// What the parts of a simulated CANopen node need of the device around them: objects behind their rules.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "devices/simulation/canopen_dictionary.hpp"

namespace axisd::simulation {

/// What a device adds to its table. Called from within the server's advance() and on_frame().
struct CanopenHooks {
  /// The value of an object that the device computes; nothing: what is in RAM.
  std::function<std::optional<std::int64_t>(const ObjectRow& row)> read;
  /// A write that the table allows, before it is stored: an abort code, or none. `store`: true to begin with;
  /// false keeps the value out of RAM (a command).
  std::function<std::uint32_t(const ObjectRow& row, std::int64_t value, bool& store)> write;
  /// After the value was stored.
  std::function<void(const ObjectRow& row)> written;
  /// May a write to `row`, which RAM holds already, go to the EEPROM? None: everything that is rw_saved.
  std::function<bool(const ObjectRow& row)> saves;
  /// Objects that PDOs carry may change with time alone (a motor turns).
  std::function<bool()> changing;
};

/// Reads and writes as they come over the network, whatever the service.
class CanopenObjects {
 public:
  CanopenObjects(CanopenDictionary& dictionary, CanopenHooks hooks)
      : dictionary_(&dictionary), hooks_(std::move(hooks)) {}

  [[nodiscard]] CanopenDictionary& dictionary() { return *dictionary_; }
  [[nodiscard]] const CanopenDictionary& dictionary() const { return *dictionary_; }
  [[nodiscard]] const CanopenHooks& hooks() const { return hooks_; }
  /// Past the access rules.
  [[nodiscard]] std::int64_t value(const ObjectRow& row) const;
  /// An abort code, or none and the object's bytes.
  std::uint32_t read(std::uint16_t index, std::uint8_t sub, std::vector<std::uint8_t>& bytes) const;
  /// `bytes` as many as the object has; fewer only if `shorter_allowed`.
  std::uint32_t write(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> bytes,
                      bool shorter_allowed);

 private:
  CanopenDictionary* dictionary_;
  CanopenHooks hooks_;
};

}  // namespace axisd::simulation
