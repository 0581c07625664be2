#include "tests/support/indexing.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "tests/support/rig.hpp"

namespace axisd::test {

using namespace std::chrono_literals;

namespace {

constexpr auto pause_after_refusal = 20ms;
constexpr auto ramp = 20ms;
constexpr std::size_t kept_failures = 10;

}  // namespace

IndexingAxes::IndexingAxes(VirtualWorld& world, core::MachineCore& machine, std::vector<std::string> axes,
                           Way way)
    : world_(&world), machine_(&machine), way_(way) {
  for (auto& name : axes) {
    idle_.push_back(axes_.size());
    axes_.push_back({.name = std::move(name)});
  }
}

void IndexingAxes::make_ready() {
  const auto online = [this] {
    return std::ranges::all_of(axes_, [this](const Indexed& axis) {
      return machine_->find(axis.name)->snapshot()->link == LinkState::online;
    });
  };
  if (!world_->run_until(online, 120s)) throw std::runtime_error("not every axis came online");
  for (const auto& axis : axes_) complete(axis.name, EnableRequest{});
  for (const auto& axis : axes_) complete(axis.name, SetPositionRequest{.position = 0});
}

void IndexingAxes::complete(const std::string& axis, const Action& action) {
  const auto command = machine_->submit(axis, action, {.arrived = world_->now()});
  if (!command) throw std::runtime_error(to_string(command.error()));
  world_->run_until([&] { return (*command)->has_ended(); }, 20s);
  const auto& value = (*command)->value();
  if (value.state != CommandState::done) throw std::runtime_error(axis + ": " + describe(value));
}

void IndexingAxes::run(Duration duration) {
  go_on([] { return false; }, world_->now() + duration);
}

void IndexingAxes::run_moves(long moves) {
  const auto enough = all_done_ + moves;
  go_on([&] { return all_done_ >= enough; }, world_->now() + moves * Duration(1s));
  if (all_done_ < enough) throw std::runtime_error("the axes do not get on");
}

void IndexingAxes::go_on(const std::function<bool()>& enough, TimePoint until) {
  while (!enough() && world_->now() < until) {
    for (const auto index : std::exchange(idle_, {})) next(index);
    const auto waiting = idle_.size();
    const auto left = until - world_->now();
    world_->run_until([&] { return idle_.size() > waiting || enough(); },
                      waiting == 0 ? left : std::min<Duration>(left, pause_after_refusal));
  }
}

void IndexingAxes::stop(std::size_t axis) {
  auto& indexed = axes_.at(axis);
  indexed.doing = Doing::stops;  // the move ends while the stop is accepted
  auto stop = machine_->submit(indexed.name, StopRequest{}, {.arrived = world_->now()});
  if (!stop) throw std::runtime_error(to_string(stop.error()));
  indexed.stop = std::move(*stop);
}

void IndexingAxes::next(std::size_t index) {
  auto& axis = axes_[index];
  if (axis.doing == Doing::stops) {
    if (!axis.stop->has_ended()) return idle_.push_back(index);
    axis.doing = Doing::moves;
  }
  auto target = axis.away ? way_.near : way_.far;
  if (way_.spread > 0) target += way_.spread * static_cast<double>(random_() >> 11U) * 0x1p-53;
  const MoveAbsoluteRequest request{.position = target, .with = {.acceleration_time = ramp}};
  const auto move = machine_->submit(axis.name, request, {.arrived = world_->now()});
  if (!move) {
    ++refused;
    return idle_.push_back(index);
  }
  axis.move = *move;
  if (axis.move->has_ended()) return ended(index, axis.move->value());
  axis.move->observe(alive_, [this, index](const Command& now) {
    if (axisd::ended(now.state)) ended(index, now);
  });
}

void IndexingAxes::ended(std::size_t index, const Command& move) {
  auto& axis = axes_[index];
  if (move.started_at) longest_wait = std::max<Duration>(longest_wait, *move.started_at - move.accepted_at);
  if (move.state == CommandState::done) {
    ++axis.done;
    ++all_done_;
    axis.away = !axis.away;
  } else if (axis.doing == Doing::moves) {
    ++failed;
    if (failures.size() < kept_failures) failures.push_back(axis.name + ": " + describe(move));
  }
  if (on_end) on_end(index, move);
  if (way_.pause == Duration{}) return idle_.push_back(index);
  axis.rested =
      world_->clock().call_at(world_->now() + way_.pause, [this, index] { idle_.push_back(index); });
}

}  // namespace axisd::test
