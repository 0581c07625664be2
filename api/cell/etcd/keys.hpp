// The cell's keys in etcd, and what comes from there: written by others, so nothing of it is believed. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "api/cell/kept.pb.h"

namespace axisd::cell::etcd {

/// Keys below "/axisd/CELL/".
class Keys {
 public:
  explicit Keys(std::string_view cell);

  [[nodiscard]] const std::string& prefix() const { return prefix_; }
  /// The first key behind all that begin with prefix().
  [[nodiscard]] std::string prefix_end() const;
  [[nodiscard]] const std::string& stop_all() const { return stop_all_; }
  [[nodiscard]] std::string of_machine(std::string_view name) const { return machines_ + std::string(name); }
  /// The name of the machine whose key this is; nothing: it is another key, or no name.
  [[nodiscard]] std::optional<std::string> machine_of(std::string_view key) const;

 private:
  std::string prefix_, machines_, stop_all_;
};

/// What a machine says of itself; nothing: it cannot be believed: not readable, of another name, beyond what
/// such a thing may carry, with addresses that are none.
[[nodiscard]] std::optional<kept::Registration> registration_of(std::string_view name,
                                                                std::string_view value);
/// Whether it is one, whoever wrote it.
[[nodiscard]] bool is_usable(const kept::Registration& registration);

}  // namespace axisd::cell::etcd
