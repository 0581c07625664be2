#include "buses/modbus_rtu/quarantine.hpp"

#include <algorithm>

namespace axisd::modbus_rtu {

namespace {

/// Its drive may be turning its motor, and is told to stop as soon as it is there again.
bool is_urgent(const Quarantine::Node& node, TimePoint now) {
  return node.owed_since && now - *node.owed_since < quarantine_owed_time;
}

}  // namespace

void Quarantine::silent(std::uint8_t node, TimePoint now, Duration cost, Unanswered what) {
  const bool stop = what == Unanswered::stop;
  auto& known = nodes_[node];
  known.good = 0;
  known.stop_in_vain = known.stop_in_vain || stop;
  if (what == Unanswered::owed_stop && !known.owed_since) known.owed_since = now;
  // Stops alone do not put a node there: their repetitions are few, and urgent.
  if (stop && known.level == 0) return;
  const bool was_there = known.quarantined();
  ++known.silent;
  if (known.level == 0 && known.answered_once && known.silent < quarantine_after) return;
  constexpr int most_doublings = 20;
  if (was_there) {
    ++known.probes;
  } else {
    known.since = now;
    known.probes = 0;
    ++known.entered;
  }
  known.level = std::clamp(known.level + 1, 1, most_doublings);
  auto hold = std::min(quarantine_first_hold * (1 << (known.level - 1)), longest_hold(cost));
  if (is_urgent(known, now)) hold = std::min(hold, longest_owed_hold(now, cost));
  // A stop that came before its turn is made up for by the next probe; however many came, only once: a node
  // that is back is not to wait for what somebody did while it was gone.
  known.next = std::min(std::max(known.next, now) + hold, now + 2 * hold);
}

Duration Quarantine::longest_hold(Duration cost) const {
  const auto silent = std::ranges::count_if(nodes_, [](const auto& one) { return one.second.quarantined(); });
  return std::min(cost * quarantine_share,
                  std::max(quarantine_longest_hold, cost * quarantine_common_share * silent));
}

Duration Quarantine::longest_owed_hold(TimePoint now, Duration cost) const {
  const auto urgent =
      std::ranges::count_if(nodes_, [now](const auto& one) { return is_urgent(one.second, now); });
  return cost * quarantine_owed_share * urgent;
}

void Quarantine::answered(std::uint8_t node) {
  auto& known = nodes_[node];
  known.answered_once = true;
  known.silent = 0;
  known.stop_in_vain = false;
  known.owed_since.reset();
  known.next = {};
  // Whoever is there again waits briefly only, so that an axis soon knows when it is gone once more.
  known.level = ++known.good >= quarantine_trust_after ? 0 : std::min(known.level, 1);
}

void Quarantine::forget() {
  for (auto& [address, node] : nodes_) node = {.entered = node.entered};
}

bool Quarantine::doubtful(std::uint8_t node) const {
  const auto* known = nodes_.find(node);
  return known != nullptr && (known->stop_in_vain || known->quarantined());
}

TimePoint Quarantine::ready_at(std::uint8_t node) const {
  const auto* known = nodes_.find(node);
  return known == nullptr ? TimePoint{} : known->next;
}

}  // namespace axisd::modbus_rtu
