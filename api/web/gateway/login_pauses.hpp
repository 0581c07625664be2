// Growing pauses after failed log-ins. Pure.
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "buses/clock.hpp"

namespace axisd::web {

/// Counts failures of each name from each address, and of each address. Who guesses waits, and others at
/// that address a little: nobody is locked out by a stranger. Thread: one at a time.
class LoginPauses {
 public:
  static constexpr int free_attempts = 3;
  static constexpr Duration first = std::chrono::seconds(1);
  static constexpr Duration longest_of_name = std::chrono::minutes(1),  ///< from one address
      longest_of_address = std::chrono::seconds(5);
  /// Without another failure all is forgotten.
  static constexpr Duration remembered = std::chrono::minutes(15);
  static constexpr std::size_t most = 4096;  ///< addresses, and names, that are remembered

  /// Until the next attempt; 0: now.
  [[nodiscard]] Duration left(const std::string& address, const std::string& name, TimePoint now) const;
  void failed(const std::string& address, const std::string& name, TimePoint now);
  void succeeded(const std::string& address, const std::string& name);

 private:
  struct Failures {
    int count = 0;
    TimePoint last{};
  };
  using Table = std::map<std::string, Failures, std::less<>>;
  static Duration left_of(const Table& table, const std::string& key, Duration longest, TimePoint now);
  static void count(Table& table, const std::string& key, TimePoint now);

  Table addresses_, names_;
};

}  // namespace axisd::web
