#include "tests/chaos/episode.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "tests/chaos/client.hpp"
#include "tests/chaos/hands.hpp"
#include "tests/chaos/indexer.hpp"
#include "tests/chaos/judge.hpp"
#include "tests/chaos/plant.hpp"

namespace axisd::chaos {

using namespace std::chrono_literals;

namespace {

constexpr auto faulty_time = 30s;
constexpr auto look_period = 25ms;

/// Looks at the positions again and again.
class Looker {
 public:
  Looker(Plant& plant, Judge& judge) : plant_(&plant), judge_(&judge) { wait(); }

 private:
  void wait() {
    next_ = plant_->world.clock().call_at(plant_->world.now() + look_period, [this] {
      plant_->settle();
      judge_->look();
      wait();
    });
  }
  Plant* plant_;
  Judge* judge_;
  Clock::Timer next_;
};

/// The faults have ended: every axis comes back, and every one can be stopped.
void settle(Plant& plant, Judge& judge) {
  plant.set_faulty(false);
  plant.world.run_for(3s);  // replies that are late, and drives that boot
  plant.world.run_until(
      [&] {
        return std::ranges::all_of(plant.stations, [](const Station& station) {
          return station.axis->snapshot()->link == LinkState::online;
        });
      },
      60s);
  for (auto& station : plant.stations) {
    const auto state = station.axis->snapshot();
    if (state->link != LinkState::online)
      judge.violation(station.name, fmt::format("stays {}: {}", to_string(state->link),
                                                state->link_error ? to_string(*state->link_error) : ""));
    plant.machine->release_stop(station.name, {.client = "the end", .whose = HoldRelease::Whose::everybody},
                                [](const auto&) {});
    judge.stop_asked(station.name);
  }
  judge.inhibited(true);
  const auto stops = plant.machine->stop_all("the end");
  for (const auto& stop : stops) judge.accepted(*stop);
  plant.world.run_until(
      [&] { return std::ranges::all_of(stops, [](const auto& stop) { return (*stop)->has_ended(); }); }, 30s);
  for (const auto& stop : stops)
    if ((*stop)->value().state != CommandState::done)
      judge.violation((*stop)->value().axis, "the last stop is not confirmed");
  plant.world.run_for(1s);
  judge.conclude();
}

/// Of the options of test_chaos.
std::string_view suffix(PlantKind kind) {
  switch (kind) {
    case PlantKind::network:
      return "-can";
    case PlantKind::full_line:
      return "-index";
    case PlantKind::generic:
      return "-generic";
    case PlantKind::lines:
      break;
  }
  return "";
}

}  // namespace

void Outcome::add(const Outcome& other) {
  transactions += other.transactions;
  faulted += other.faulted;
  can_transactions += other.can_transactions;
  can_faulted += other.can_faulted;
  for (const auto part :
       {&Outcome::commands, &Outcome::done, &Outcome::not_executed, &Outcome::starts, &Outcome::stops,
        &Outcome::positions, &Outcome::marks, &Outcome::departures, &Outcome::distances,
        &Outcome::by_terminal, &Outcome::by_sync, &Outcome::violations})
    this->*part += other.*part;
}

Outcome run_episode(PlantKind kind, std::uint64_t seed) {
  Plant plant(kind, seed);
  Judge judge(plant);
  plant.set_faulty(true);
  {
    const Looker looker(plant, judge);
    std::vector<std::unique_ptr<Client>> clients;
    const bool full = kind == PlantKind::full_line;
    for (const auto* name : full ? std::vector{"anna"} : std::vector{"anna", "bert", "cora"})
      clients.push_back(std::make_unique<Client>(plant, judge, name, seed * 10 + clients.size() + 1));
    std::optional<Indexer> indexer;
    if (full) indexer.emplace(plant, judge, seed * 10 + 8);
    Hands hands(plant, seed * 10 + 9);
    plant.world.run_for(faulty_time);
    hands.rest();
    indexer.reset();
    for (const auto& client : clients) client->rest();
    settle(plant, judge);
  }
  for (const auto& violation : judge.violations()) ADD_FAILURE() << violation;
  if (!judge.violations().empty())
    ADD_FAILURE() << fmt::format("repeat it with: test_chaos --seed{} {}", suffix(kind), seed);
  const auto& tally = judge.tally();
  return {.transactions = plant.on_lines().transactions,
          .faulted = plant.on_lines().faulted,
          .can_transactions = plant.on_can().transactions,
          .can_faulted = plant.on_can().faulted,
          .commands = tally.commands,
          .done = tally.done,
          .not_executed = tally.not_executed,
          .starts = tally.starts,
          .stops = tally.stops,
          .positions = tally.positions,
          .marks = tally.marks,
          .departures = tally.departures,
          .distances = tally.distances,
          .by_terminal = tally.by_terminal,
          .by_sync = tally.by_sync,
          .violations = static_cast<int>(judge.violations().size())};
}

Outcome run_episodes(PlantKind kind, std::uint64_t first_seed, std::uint64_t faulted) {
  Outcome all;
  const bool on_can = kind == PlantKind::network || kind == PlantKind::generic;
  const auto& struck = on_can ? all.can_faulted : all.faulted;
  for (auto seed = first_seed; struck < faulted && all.violations == 0; ++seed)
    all.add(run_episode(kind, seed));
  return all;
}

}  // namespace axisd::chaos
