#include "tests/bench/can_index.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/bench/can_cell.hpp"
#include "tests/support/indexing.hpp"

namespace axisd::bench {

using namespace std::chrono_literals;

namespace {

struct Mode {
  const char* name;
  Duration sync_period;
  States states;
};
constexpr std::array modes{Mode{"SDO", {}, States::by_sdo}, Mode{"PDO by events", {}, States::by_pdo},
                           Mode{"PDO, SYNC 20 ms", 20ms, States::by_pdo},
                           Mode{"PDO, SYNC 10 ms", 10ms, States::by_pdo}};

/// Sees every frame of the network.
class Listener {
 public:
  explicit Listener(can::Network& network)
      : network_(&network), id_(network.join([this](const can::Frame& frame, TimePoint, bool) {
          ++frames;
          busy += network_->frame_time(frame);
          if (on_frame) on_frame(frame);
        })) {}
  ~Listener() { network_->leave(id_); }
  Listener(const Listener&) = delete;
  void forget() {
    frames = 0;
    busy = {};
  }

  long frames = 0;
  Duration busy{};
  std::function<void(const can::Frame&)> on_frame;

 private:
  can::Network* network_;
  can::Network::Id id_;
};

std::vector<std::string> names(int first, int last) {
  std::vector<std::string> all;
  for (int node = first; node <= last; ++node) all.push_back(fmt::format("axis-{}", node));
  return all;
}

/// All nodes enabled, at 0, and those that can start by SYNC have shown it.
void make_ready(Cell& cell, int nodes) {
  (void)cell.bring_up();
  cell.world.run_for(3s + nodes * 100ms);
  test::IndexingAxes(cell.world, *cell.machine, names(1, nodes)).make_ready();
}

double in_s(Duration duration) { return std::chrono::duration<double>(duration).count(); }

/// What a master that does nothing but send SYNC makes of the bus, in %.
double bare_load(Cell& cell, Listener& listener, Duration period) {
  const BareMaster bare(cell.world.clock(), cell.network, period);
  cell.world.run_for(1s);
  listener.forget();
  cell.world.run_for(10s);
  return in_s(listener.busy) / 10 * 100;
}

bool index_in(const Mode& mode, int nodes, long moves) {
  Cell cell({.nodes = nodes, .sync_period = mode.sync_period, .states = mode.states});
  make_ready(cell, nodes);
  Listener listener(cell.network);
  double rate = 0, frames = 0, load = 0, deviation = 0;
  long failed = 0, refused = 0;
  Duration wait{};
  {
    test::IndexingAxes indexing(cell.world, *cell.machine, names(1, nodes));
    indexing.run_moves(long{4} * nodes);
    listener.forget();
    std::vector<long> before;
    for (std::size_t i = 0; i < indexing.count(); ++i) before.push_back(indexing.done_of(i));
    const auto all_before = indexing.all_done();
    const auto begin = cell.world.now();
    indexing.run_moves(moves);
    const auto taken = in_s(cell.world.now() - begin);
    const auto done = static_cast<double>(indexing.all_done() - all_before), share = done / nodes;
    for (std::size_t i = 0; i < indexing.count(); ++i)
      deviation = std::max(deviation,
                           std::abs(static_cast<double>(indexing.done_of(i) - before[i]) / share - 1) * 100);
    rate = done / taken;
    frames = static_cast<double>(listener.frames) / done;
    load = in_s(listener.busy) / taken * 100;
    failed = indexing.failed;
    refused = indexing.refused;
    wait = indexing.longest_wait;
    for (const auto& failure : indexing.failures) fmt::print("  {}\n", failure);
  }
  cell.close();
  const auto bare = mode.sync_period > Duration{} ? bare_load(cell, listener, mode.sync_period) : 0;
  fmt::print("{:<16} {:>5} {:>8.1f} {:>7.1f} {:>7.1f} {:>9.1f} {:>7.2f} {:>9.1f} {:>7} {:>6}\n", mode.name,
             nodes, rate, frames, load, bare, deviation, ms(wait), refused, failed);
  return failed == 0;
}

/// Looks at the drives themselves, again and again: when the first and the last of them started.
class Starts {
 public:
  Starts(Cell& cell, int members) : cell_(&cell), members_(members), before_(count()) { look(); }
  Starts(const Starts&) = delete;
  [[nodiscard]] Duration skew() const { return last_ - first_; }
  [[nodiscard]] long seen() const { return seen_; }

 private:
  static constexpr Duration period = 50us;
  [[nodiscard]] long count() const {
    long all = 0;
    for (int node = 1; node <= members_; ++node)
      all += cell_->simulated.nodes().node(static_cast<std::uint8_t>(node))->starts();
    return all;
  }
  void look() {
    cell_->simulated.nodes().advance();
    if (const auto more = count() - before_ - seen_; more > 0) {
      seen_ += more;
      last_ = cell_->world.now();
      if (first_ == TimePoint{}) first_ = last_;
    }
    next_ = cell_->world.clock().call_at(cell_->world.now() + period, [this] { look(); });
  }
  Cell* cell_;
  int members_;
  long before_, seen_ = 0;
  TimePoint first_{}, last_{};
  Clock::Timer next_;
};

/// The members move once, while `others` index.
GroupMove move_group(Cell& cell, test::IndexingAxes& others, int members, double target) {
  GroupMoveRequest request;
  for (const auto& name : names(1, members)) request.targets.push_back({.axis = name, .position = target});
  const auto run = cell.machine->groups().move(request, {.arrived = cell.world.now()});
  if (!run) throw std::runtime_error(to_string(run.error()));
  for (int left = 60'000; left > 0 && !ended((*run)->state()); --left) others.run(1ms);
  auto move = (*run)->value();
  if (move.state != CommandState::done)
    throw std::runtime_error(
        fmt::format("a group of {}: {}", members, move.cause ? to_string(*move.cause) : "not done"));
  return move;
}

bool groups_of(const Mode& mode, int nodes, int members) {
  constexpr int rounds = 4;
  Cell cell({.nodes = nodes, .sync_period = mode.sync_period, .states = mode.states});
  make_ready(cell, nodes);
  Duration skew{}, told{};
  long started = 0, targets = 0, by_sync = 0, failed = 0;
  {
    test::IndexingAxes others(cell.world, *cell.machine, names(members + 1, nodes));
    Listener listener(cell.network);
    listener.on_frame = [&](const can::Frame& frame) {
      const auto node = static_cast<int>(frame.id) - 0x600;
      const bool download = (frame.data[0] & 0xE0U) == 0x20U;
      if (node >= 1 && node <= members && download && frame.data[1] == 0x7A && frame.data[2] == 0x60)
        ++targets;
    };
    for (int round = 0; round < rounds; ++round) {
      const Starts starts(cell, members);
      const auto move = move_group(cell, others, members, round % 2 == 0 ? 1 : 0);
      skew = std::max(skew, starts.skew());
      told = std::max(told, move.start_skew.value_or(Duration{}));
      started += starts.seen();
      by_sync += std::ranges::count_if(move.members, &GroupMember::by_sync);
    }
    failed = others.failed;
    for (const auto& failure : others.failures) fmt::print("  {}\n", failure);
  }
  cell.close();
  const bool once = started == long{rounds} * members && failed == 0;
  fmt::print("{:<16} {:>7} {:>9.2f} {:>9.2f} {:>7} {:>6} {:>7}{}\n", mode.name, members, ms(skew), ms(told),
             by_sync, started, targets, once ? "" : "  NOT MET");
  return once;
}

}  // namespace

bool run_index(int nodes, long moves) {
  fmt::print(
      "axes of a network of 1 Mbit/s that index at once; load of the bus in %, and what a bare SYNC loop "
      "makes of "
      "it;\nlargest deviation of an axis from its share; longest time from acceptance until active\n");
  fmt::print("{:<16} {:>5} {:>8} {:>7} {:>7} {:>9} {:>7} {:>9} {:>7} {:>6}\n", "state by", "axes", "moves/s",
             "frames", "load, %", "SYNC, %", "dev., %", "wait, ms", "refused", "failed");
  bool good = true;
  for (const auto& mode : modes) good = index_in(mode, nodes, moves) && good;
  return good;
}

bool run_groups(int nodes) {
  fmt::print(
      "groups of a network of {} axes, the others index: longest skew of the drives' own starts (seen each "
      "0.05 ms) "
      "and as told, ms;\nmembers that started by SYNC, starts, and targets that were written (607Ah), of all "
      "rounds\n",
      nodes);
  fmt::print("{:<16} {:>7} {:>9} {:>9} {:>7} {:>6} {:>7}\n", "state by", "members", "skew, ms", "told, ms",
             "by SYNC", "starts", "targets");
  bool good = true;
  for (const auto& mode : {modes.front(), modes.back()})
    for (int members = 2; members <= nodes; ++members) good = groups_of(mode, nodes, members) && good;
  return good;
}

}  // namespace axisd::bench
