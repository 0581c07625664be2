// Several simulated YSS-C on one network, each with its driver and what an axis does to keep it: identify,
// configure, look after it. The group is the test.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "buses/can/network.hpp"
#include "buses/canopen/canopen_bus.hpp"
#include "buses/signal.hpp"
#include "devices/cia402/drive.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/yss_c/model.hpp"
#include "devices/yss_c/simulator.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

using namespace std::chrono_literals;

struct GroupBenchOptions {
  int drives = 2;
  simulation::Switches switches{};
  Duration sync_period = 10ms;
  /// Called between the drives' boot and the first contact.
  std::function<void(simulation::SimulatedCanNode&)> before_start{};
};

class GroupBench {
 public:
  struct Member {
    simulation::SimulatedCanNode* node = nullptr;
    std::unique_ptr<Drive> drive;
    std::shared_ptr<AxisGate> gate = std::make_shared<AxisGate>();
    std::unique_ptr<PreparedMove> move;
    bool configured = false, online = false;
    std::uint64_t losses = 0;
    [[nodiscard]] MotionGuard guard() const { return {.gate = gate, .epoch = gate->epoch()}; }
  };

  explicit GroupBench(GroupBenchOptions options = {})
      : network(world.clock(), 1'000'000),
        drives_(world.clock(), network),
        bus(world.executor(), world.clock(),
            {.name = "can0", .interface = "sim", .sync_period = options.sync_period}, make_port()) {
    nodes().set_observer(
        [this](TimePoint at, bool, const can::Frame& frame) { frames.emplace_back(at, frame); });
    for (int i = 0; i < options.drives; ++i) {
      simulation::SimulatedNodeSettings settings{.address = static_cast<std::uint8_t>(16 + i),
                                                 .switches = options.switches};
      auto& member = members.emplace_back();
      member.node = &nodes().add(std::make_unique<yss_c::SimulatedDrive>(std::move(settings)));
    }
    run(1s);
    for (auto& member : members) {
      if (options.before_start) options.before_start(*member.node);
      DriveContext context{.executor = world.executor(), .clock = &world.clock(), .canopen = &bus};
      context.node = member.node->address();
      context.setup.pulses_per_revolution = 1000;
      context.setup.reboot_guard = 100ms;
      context.setup.model_settings = {{"overtravel_stop", SettingValue(std::string("quick_stop"))},
                                      {"loop_mode", SettingValue(std::string("closed"))}};
      member.drive = cia402::make_drive(yss_c::model(), std::move(context));
    }
    nodes().advance();
    bus.start();
    for (auto& member : members) spawn(world.executor(), keep(member), "keeper");
  }
  ~GroupBench() {
    closing_ = true;
    run(10s);
    bus.close();
    run(5s);
    for (auto& member : members) member.move.reset();
  }
  GroupBench(const GroupBench&) = delete;

  void run(Duration duration) { world.run_for(duration); }
  bool run_until(const std::function<bool()>& done, Duration limit) { return world.run_until(done, limit); }
  template <class T>
  Result<T> finish(Task<Result<T>> task, Duration limit = 60s) {
    auto result = std::make_shared<std::optional<Result<T>>>();
    const auto store = [](Task<Result<T>> inner, std::shared_ptr<std::optional<Result<T>>> to) -> Task<> {
      *to = co_await std::move(inner);
    };
    spawn(world.executor(), store(std::move(task), result), "test");
    if (!run_until([&] { return result->has_value(); }, limit))
      return fail(Reason::internal, "it does not end");
    return std::move(**result);
  }

  bool online(Duration limit = 20s) {
    return run_until([this] { return std::ranges::all_of(members, &Member::online); }, limit);
  }
  bool proven(Duration limit = 20s) {
    return run_until(
        [this] {
          return std::ranges::all_of(members,
                                     [](auto& member) { return member.drive->no_common_start().empty(); });
        },
        limit);
  }
  /// Online, proven, enabled.
  void ready() {
    ASSERT_TRUE(online());
    ASSERT_TRUE(proven()) << members.front().drive->no_common_start();
    for (auto& member : members) {
      const auto enabled = finish(member.drive->enable(member.guard()));
      ASSERT_TRUE(enabled) << to_string(enabled.error());
    }
  }
  Result<void> prepare(std::int32_t target) {
    // As an axis does: a chain of its own and a look at the drive do not mix.
    preparing_ = true;
    run_until([this] { return looking_ == 0; }, 5s);
    for (auto& member : members) {
      auto move = finish(member.drive->prepare_move({.target_pulses = target,
                                                     .velocity_rpm = 300,
                                                     .acceleration_time = 50ms,
                                                     .deceleration_time = 50ms},
                                                    member.guard()));
      if (!move) return fail(move.error());
      member.move = std::move(*move);
    }
    preparing_ = false;
    return {};
  }
  [[nodiscard]] Task<Result<TimePoint>> start_all() {
    std::vector<PreparedMove*> others;
    for (std::size_t i = 1; i < members.size(); ++i) others.push_back(members[i].move.get());
    return members.front().move->start_with(std::move(others), {});
  }
  Result<TimePoint> start() { return finish(start_all()); }
  /// Begins it, and says there how it ended.
  std::optional<Result<TimePoint>>& launch() {
    const auto store = [](GroupBench& self) -> Task<> { self.started_ = co_await self.start_all(); };
    started_.reset();
    frames.clear();
    spawn(world.executor(), store(*this), "start");
    return started_;
  }
  /// What a group does when one of its axes does not start, or stops.
  void stop_all() {
    for (auto& member : members) stop(member);
  }
  void stop(Member& member) {
    member.gate->raise();
    bus.purge_superseded(member.node->address(), *member.gate);
    spawn(world.executor(), stop_of(member), "stop");
  }

  [[nodiscard]] simulation::CanNodes& nodes() { return drives_.nodes(); }
  void fault(const simulation::Fault& fault) { nodes().add_fault(fault); }
  void touch(Member& member, const std::function<void(simulation::SimulatedCanNode&)>& how) {
    nodes().advance();
    how(*member.node);
    nodes().advance();
  }
  /// A frame of somebody else on the network.
  void put(std::uint32_t id, const std::vector<std::uint8_t>& bytes) {
    if (other_ == 0) other_ = network.join([](const can::Frame&, TimePoint, bool) {});
    network.transmit(other_, can::make_frame(id, bytes));
  }
  [[nodiscard]] std::int64_t shaft(Member& member) {
    nodes().advance();
    return member.node->shaft_pulses();
  }
  [[nodiscard]] long count_of(std::uint32_t id) const {
    return std::ranges::count_if(frames, [id](const auto& entry) { return entry.second.id == id; });
  }
  [[nodiscard]] bool any_moves() {
    nodes().advance();
    return std::ranges::any_of(members, [](auto& member) { return member.node->shaft_moving(); });
  }
  [[nodiscard]] can::NetworkPort& port() { return *port_; }

  VirtualWorld world;
  can::Network network;
  std::vector<std::pair<TimePoint, can::Frame>> frames;  ///< that passed the wire

 private:
  simulation::NetworkNodes drives_;
  can::NetworkPort* port_ = nullptr;

 public:
  canopen::CanopenBus bus;
  std::vector<Member> members;

 private:
  std::unique_ptr<can::NetworkPort> make_port() {
    auto made = std::make_unique<can::NetworkPort>(
        world.clock(), can::PortSettings{.bus = "can0", .interface = "sim", .bitrate = 1'000'000}, network);
    port_ = made.get();
    return made;
  }
  static Task<> stop_of(Member& member) { (void)co_await member.drive->stop(StopKind::stop); }

  Task<> keep(Member& member) {
    while (!closing_) {
      if (!preparing_) {
        ++looking_;
        co_await look_after(member);
        --looking_;
      }
      co_await sleep_until(world.executor(), world.clock(), world.now() + 100ms);
    }
  }
  Task<> look_after(Member& member) {
    if (member.losses != bus.losses()) member.online = false;
    member.losses = bus.losses();
    Result<void> done;
    if (!member.online) {
      const auto found = co_await member.drive->identify(TransactionClass::parameters);
      if (!found) co_return;
      done = member.configured ? co_await member.drive->check_continuity(TransactionClass::parameters)
                               : co_await member.drive->configure();
      if (done) member.configured = true;
    } else {
      done = co_await member.drive->check_continuity(TransactionClass::idle_state);
    }
    member.online = done.has_value();
    if (!done && done.error().reason == Reason::rebooted) member.configured = false;
  }

  std::optional<Result<TimePoint>> started_;
  can::Network::Id other_ = 0;
  bool closing_ = false, preparing_ = false;
  int looking_ = 0;
};

}  // namespace axisd::test
