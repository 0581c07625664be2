#include "tests/chaos/client.hpp"

#include <fmt/format.h>

#include <utility>

namespace axisd::chaos {

using namespace std::chrono_literals;

Client::Client(Plant& plant, Judge& judge, std::string name, std::uint64_t seed)
    : plant_(&plant), judge_(&judge), name_(std::move(name)), dice_(seed) {
  wait();
}

void Client::wait() {
  const auto pause = dice_.chance(0.3) ? dice_.up_to(20ms) : dice_.up_to(500ms);
  next_ = plant_->world.clock().call_at(plant_->world.now() + pause, [this] {
    act();
    wait();
  });
}

/// Mostly in time.
void Client::coordinate() {
  const auto run = prepared_.lock();
  if (!run) return;
  run->renew(dice_.chance(0.8) ? GroupRenewal::all_told : GroupRenewal::waits);
  if (run->prepared() && dice_.chance(0.7)) (void)run->start_at(plant_->world.now() + dice_.up_to(1500ms));
}

void Client::act() {
  coordinate();
  auto& station =
      plant_->stations.at(static_cast<std::size_t>(dice_.pick(static_cast<int>(plant_->stations.size()))));
  const int what = dice_.pick(100);
  if (what < 8) return stop(station);
  if (what < 9) return stop_all();
  if (what < 20) return read_marks(station);
  if (what < 26) return repeat();
  if (what < 28 && last_ && last_->command) {
    (void)plant_->find(last_->axis)->axis->cancel(last_->command);
    return;
  }
  if (plant_->machine->inhibited_by() != nullptr && what < 60)
    return plant_->machine->release_inhibit(name_, [this](const Result<void>& released) {
      if (released) judge_->inhibited(false);
    });
  if (!station.axis->snapshot()->holds.empty() && what < 80)
    return plant_->machine->release_stop(
        station.name, {.client = name_, .whose = HoldRelease::Whose::everybody}, [](const auto&) {});
  if (what < 68 && plant_->machine->inhibited_by() == nullptr && dice_.chance(0.2)) return move_group();
  submit(station, sensible(station));
}

/// Some axes together, on any bus or on one that could start them by one SYNC; mostly such that can move now.
void Client::move_group() {
  GroupMoveRequest request{.arrive_together = dice_.chance(0.5)};
  const bool by_sync = std::ranges::any_of(plant_->stations, &Station::on_can) && dice_.chance(0.5);
  const double share = by_sync ? 0.9 : 2.5 / static_cast<double>(plant_->stations.size());
  const bool sensibly = dice_.chance(0.8);
  for (const auto& station : plant_->stations) {
    const auto state = station.axis->snapshot();
    if (!state->enabled || (by_sync && !station.on_can()) || !dice_.chance(share)) continue;
    const bool ready = state->state == AxisState::standstill && state->trust != PositionTrust::unknown;
    if (sensibly && !ready) continue;
    GroupTarget target{.axis = station.name, .with = {.velocity = static_cast<double>(10 + dice_.pick(90))}};
    if (dice_.chance(0.5))
      target.position = static_cast<double>(dice_.pick(60));
    else
      target.distance = (dice_.pick(4001) - 2000) / 100.0;
    request.targets.push_back(std::move(target));
  }
  if (request.targets.empty()) return;
  if (dice_.chance(0.4)) request.start = GroupStart::when_told;
  const auto run = plant_->machine->groups().move(
      request, {.client = name_, .request_id = fmt::format("{}-{}", name_, ++requests_)});
  if (!run) return;
  if (request.start == GroupStart::when_told) prepared_ = *run;
  for (const auto& command : (*run)->commands()) judge_->accepted(command);
}

/// What gets on from here, mostly.
Action Client::sensible(const Station& station) {
  const auto state = station.axis->snapshot();
  if (dice_.chance(0.06)) return DisableRequest{};
  if (dice_.chance(0.05)) return SetPositionRequest{.position = static_cast<double>(dice_.pick(40))};
  if (state->state == AxisState::error_stop && dice_.chance(0.8)) return ResetRequest{};
  // A restarted drive may be energised, and has to be enabled all the same (M1).
  if (!(state->enabled && state->enabled_by_us) && dice_.chance(0.8)) return EnableRequest{};
  if (state->trust == PositionTrust::unknown && dice_.chance(0.6)) {
    if (dice_.chance(0.1)) return HomeRequest{};
    return SetPositionRequest{.position = static_cast<double>(dice_.pick(40))};
  }
  return motion(station);
}

Action Client::motion(const Station& /*station*/) {
  const MotionValues with{.velocity = static_cast<double>(10 + dice_.pick(90))};
  const int kind = dice_.pick(100);
  if (kind < 35) return MoveAbsoluteRequest{.position = static_cast<double>(dice_.pick(60)), .with = with};
  if (kind < 70) return MoveRelativeRequest{.distance = (dice_.pick(4001) - 2000) / 100.0, .with = with};
  const double velocity = dice_.chance(0.5) ? 40 : -40;
  if (kind < 85) return MoveVelocityRequest{.velocity = velocity};
  if (kind < 98) return JogRequest{.velocity = velocity, .hold = 50ms + dice_.up_to(600ms)};
  return HomeRequest{};
}

void Client::submit(const Station& station, const Action& action) {
  CommandOptions options{.client = name_, .request_id = fmt::format("{}-{}", name_, ++requests_)};
  if (dice_.chance(0.1)) options.not_after = plant_->world.now() + dice_.up_to(60ms);
  const bool may_wait = std::holds_alternative<MoveRelativeRequest>(action) ||
                        std::holds_alternative<MoveAbsoluteRequest>(action);
  if (may_wait && dice_.chance(0.4)) options.buffer_mode = BufferMode::buffered;
  const bool disable = std::holds_alternative<DisableRequest>(action);
  if (disable && station.axis->snapshot()->link != LinkState::offline) judge_->stop_asked(station.name);
  auto command = plant_->machine->submit(station.name, action, options);
  if (command) judge_->accepted(*command);
  last_ = Submitted{station.name, action, options, command ? *command : nullptr};
}

/// As a client does that did not get its answer: the same request has to be the same command.
void Client::repeat() {
  if (!last_ || !last_->command || std::holds_alternative<DisableRequest>(last_->action)) return;
  const auto again = plant_->machine->submit(last_->axis, last_->action, last_->options);
  if (!again || *again != last_->command)
    judge_->violation(last_->axis, "a repeated request is another command");
}

void Client::stop(Station& station) {
  const auto kind = dice_.chance(0.4)   ? StopKind::halt
                    : dice_.chance(0.2) ? StopKind::quick_stop
                                        : StopKind::stop;
  const StopRequest request{.kind = kind, .hold = kind == StopKind::stop && dice_.chance(0.1)};
  auto serve = [this, &station, request] {
    judge_->stop_asked(station.name);
    if (const auto command = plant_->machine->submit(station.name, request, {.client = name_}))
      judge_->accepted(*command);
  };
  if (dice_.chance(0.5)) return serve();
  // From another thread: the gate is raised at once, and the core gets to it a little later.
  station.axis->gate()->request_stop();
  judge_->stop_asked(station.name);
  later_.push_back(plant_->world.clock().call_at(plant_->world.now() + dice_.up_to(3ms), std::move(serve)));
}

void Client::stop_all() {
  for (const auto& station : plant_->stations) judge_->stop_asked(station.name);
  judge_->inhibited(true);
  for (const auto& command : plant_->machine->stop_all(name_))
    if (command) judge_->accepted(*command);
}

void Client::read_marks(const Station& station) {
  if (station.on_can() || station.wired == Wired::segment) return;  // they are its table of positions
  // Also as long as the readings of state and canary are.
  constexpr std::array<std::uint16_t, 6> lengths{1, 2, 6, 9, 10, 16};
  const auto count = lengths.at(static_cast<std::size_t>(dice_.pick(lengths.size())));
  const int offset = dice_.pick(16 - count + 1) + (dice_.chance(0.5) ? 16 : 0);
  modbus_rtu::Request request{
      .node = station.node, .address = static_cast<std::uint16_t>(marked_registers + offset), .count = count};
  auto read = [](modbus_rtu::RtuBus& bus, Judge& judge, const Station& of, int at,
                 modbus_rtu::Request what) -> Task<> {
    const auto answer = co_await bus.transact(std::move(what), {});
    if (answer) judge.check_marks(of, at, answer->registers);
  };
  spawn(plant_->world.executor(),
        read(*plant_->machine->find_line(station.bus), *judge_, station, offset, std::move(request)), "read");
}

}  // namespace axisd::chaos
