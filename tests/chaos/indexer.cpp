#include "tests/chaos/indexer.hpp"

namespace axisd::chaos {

using namespace std::chrono_literals;

namespace {

constexpr auto pause_in_vain = 20ms;
/// They stay about there, mm.
constexpr double middle = 25, furthest = 100;

}  // namespace

Indexer::Indexer(Plant& plant, Judge& judge, std::uint64_t seed)
    : plant_(&plant), judge_(&judge), dice_(seed), next_(plant.stations.size()) {
  for (std::size_t i = 0; i < next_.size(); ++i) later(i, {});
}

void Indexer::later(std::size_t index, Duration pause) {
  next_.at(index) =
      plant_->world.clock().call_at(plant_->world.now() + pause, [this, index] { next(index); });
}

void Indexer::next(std::size_t index) {
  const auto& station = plant_->stations.at(index);
  const auto command = plant_->machine->submit(station.name, action(station), {.client = "indexer"});
  if (!command) return later(index, pause_in_vain);
  judge_->accepted(*command);
  if ((*command)->has_ended()) return later(index, pause_in_vain);
  (*command)->observe(alive_, [this, index](const Command& now) {
    if (ended(now.state)) later(index, now.state == CommandState::done ? Duration{} : pause_in_vain);
  });
}

Action Indexer::action(const Station& station) {
  const auto state = station.axis->snapshot();
  if (state->state == AxisState::error_stop) return ResetRequest{};
  if (!(state->enabled && state->enabled_by_us)) return EnableRequest{};
  if (state->trust == PositionTrust::unknown || state->position < 0 || state->position > furthest)
    return SetPositionRequest{.position = middle};
  const double distance = (1 + dice_.pick(200)) / (state->position > middle ? -100.0 : 100.0);
  if (dice_.chance(0.5)) return MoveRelativeRequest{.distance = distance};
  return MoveAbsoluteRequest{.position = state->position + distance};
}

}  // namespace axisd::chaos
