#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "buses/clock.hpp"

namespace axisd {

/// How many records somebody may cause by what needs no role: so many in a minute. Further ones are counted,
/// so that nobody writes the others out of files of a bounded size (M32). Pure: time comes with each call.
/// Thread: that of its owner.
class AuditRation {
 public:
  /// In a minute, of each identity.
  static constexpr std::uint64_t refusals = 60, stops = 1'000;
  /// Identities that are told apart; all further ones share one ration.
  static constexpr std::size_t identities = 1'000;

  explicit AuditRation(std::uint64_t a_minute) : a_minute_(a_minute) {}

  /// One more of this client's identity. How many before it were not told, if it is told itself; nothing: it
  /// is counted.
  [[nodiscard]] std::optional<std::uint64_t> take(std::string_view client, TimePoint now);

 private:
  struct Minute {
    TimePoint begin{};
    std::uint64_t told = 0, left_out = 0;
  };
  [[nodiscard]] Minute& minute_of(std::string_view identity, TimePoint now);

  std::uint64_t a_minute_;
  std::map<std::string, Minute, std::less<>> minutes_;  ///< by identity
};

}  // namespace axisd
