#include "devices/audit_ration.hpp"

#include <chrono>
#include <utility>

#include "devices/access.hpp"

namespace axisd {

std::optional<std::uint64_t> AuditRation::take(std::string_view client, TimePoint now) {
  auto& minute = minute_of(identity_of(client), now);
  if (minute.told == a_minute_) {
    ++minute.left_out;
    return std::nullopt;
  }
  ++minute.told;
  return std::exchange(minute.left_out, 0);
}

AuditRation::Minute& AuditRation::minute_of(std::string_view identity, TimePoint now) {
  if (minutes_.size() >= identities && !minutes_.contains(identity))
    std::erase_if(minutes_, [&](const auto& other) {
      return other.second.left_out == 0 && now - other.second.begin >= std::chrono::minutes(1);
    });
  const bool told_apart = minutes_.size() < identities || minutes_.contains(identity);
  auto& minute = minutes_[told_apart ? std::string(identity) : std::string()];
  if (minute.told == 0 || now - minute.begin >= std::chrono::minutes(1)) {
    minute.begin = now;
    minute.told = 0;
  }
  return minute;
}

}  // namespace axisd
