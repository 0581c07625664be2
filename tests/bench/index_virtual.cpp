// The parts of bench_index.
#include "tests/bench/index_virtual.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/bench/index_wire.hpp"
#include "tests/rules/shared_line.hpp"
#include "tests/support/indexing.hpp"

namespace axisd::bench {

using namespace std::chrono_literals;

namespace {

constexpr double near_mm = 0.2, far_mm = 0.4;
constexpr std::int32_t near_pulses = 20, far_pulses = 40;
constexpr double largest_deviation = 0.02;  ///< of an axis's share
constexpr std::uint16_t microstep = 0x0011;

double ms(Duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

/// Of sorted or unsorted times, ms.
struct Times {
  std::vector<double> all;
  void add(Duration time) { all.push_back(ms(time)); }
  [[nodiscard]] double at(double share) {
    if (all.empty()) return 0;
    std::ranges::sort(all);
    return all[static_cast<std::size_t>(share * static_cast<double>(all.size() - 1))];
  }
};

std::vector<std::string> names(int first, int last) {
  std::vector<std::string> all;
  for (int i = first; i <= last; ++i) all.push_back("a" + std::to_string(i));
  return all;
}

enum class Polls : std::uint8_t { as_configured, as_fast_as_they_go };

/// `count` axes of one line, enabled, at 0.
struct Line {
  Line(const Given& given, int axes, int baud, Polls polls = Polls::as_configured)
      : shared(axes, baud,
               [&](AxisSettings& axis) {
                 axis.model_settings.insert(given.drive.begin(), given.drive.end());
                 if (polls == Polls::as_fast_as_they_go) axis.poll_idle = axis.poll_moving = fastest_poll;
               }),
        wire(*shared.line) {
    test::IndexingAxes(shared.world, shared.machine(), names(1, axes)).make_ready();
    wire.forget();
  }
  [[nodiscard]] TimePoint now() const { return shared.world.now(); }
  [[nodiscard]] simulation::SimulatedRtuNode& drive(std::size_t axis) {
    return *shared.line->network().node(static_cast<std::uint8_t>(axis + 1));
  }
  [[nodiscard]] BusBudgetReport budget() { return shared.machine().budgets().front(); }

  test::SharedLine shared;
  WireCount wire;
};

struct Rates {
  double rate = 0, deviation = 0;  ///< moves per second; of the axis that is furthest off its share
  double off = 0;                  ///< the same in moves
  Duration wait{}, bound{};        ///< from a move's acceptance to the last byte of its start frame
  long refused = 0, failed = 0;
  std::vector<std::string> failures;
  std::map<std::string_view, double> exchanges;  ///< a move
  RawScript::Settings raw;
};

Rates measure(const Given& given, int axes, int baud) {
  Line line(given, axes, baud);
  test::IndexingAxes indexing(line.shared.world, line.shared.machine(), names(1, axes),
                              {.near = near_mm, .far = far_mm});
  indexing.run_moves(long{10} * axes);
  Rates found{.bound = line.budget().predicted.load.at(static_cast<std::size_t>(axes)).start};
  line.wire.forget();
  line.wire.on_request = [&](const test::WireEntry& request, Purpose purpose) {
    if (!starts(purpose)) return;
    const auto& move = indexing.move_of(request.node() - std::size_t{1});
    found.wait = std::max<Duration>(found.wait,
                                    line.shared.world.clock().wall(request.end) - move->value().accepted_at);
  };
  std::vector<long> before;
  for (std::size_t i = 0; i < indexing.count(); ++i) before.push_back(indexing.done_of(i));
  const auto done_before = indexing.all_done();
  const auto begin = line.now();
  indexing.run_moves(given.numbers.at("--moves"));
  const auto moves = static_cast<double>(indexing.all_done() - done_before);
  found.rate = moves / std::chrono::duration<double>(line.now() - begin).count();
  const auto share = moves / axes;
  for (std::size_t i = 0; i < indexing.count(); ++i)
    found.off = std::max(found.off, std::abs(static_cast<double>(indexing.done_of(i) - before[i]) - share));
  found.deviation = found.off / share;
  for (std::size_t i = 0; i < purposes.size(); ++i)
    found.exchanges[purposes.at(i)] = static_cast<double>(line.wire.count(Purpose(i))) / moves;
  found.refused = indexing.refused;
  found.failed = indexing.failed;
  found.failures = indexing.failures;
  line.wire.on_request = {};
  found.raw = {.drives = axes,
               .baud = baud,
               .microstep = static_cast<std::uint16_t>(line.drive(0).peek(microstep)),
               .profile = line.wire.profile,
               .here = near_pulses,
               .there = far_pulses};
  return found;
}

/// A line that is asked for more than it can carry refuses: what an axis gets then is up to its client.
bool is_good(const Rates& found) {
  constexpr double granularity = 2;  // moves
  const bool even = found.refused > 0 || found.deviation <= largest_deviation || found.off <= granularity;
  return even && found.failed == 0 && found.wait <= found.bound;
}

}  // namespace

bool rates(const Given& given) {
  bool good = true;
  fmt::print(
      "moves per second of one line; exchanges a move: {}; largest deviation of an axis from its share;\n"
      "longest wait from acceptance to the last byte of the start frame, and its published bound\n",
      fmt::join(purposes, ", "));
  fmt::print("{:>6} {:>4} {:>8} {:>8} {:>8} {:>6} {:>6}  {:<42} {:>7} {:>9} {:>9} {:>7} {:>6}\n", "baud",
             "axes", "axisd", "apart", "one", "/apart", "/one", "exchanges a move", "dev., %", "wait, ms",
             "bound, ms", "refused", "failed");
  constexpr long enough = 5000;  // of the script's, which does the same again and again
  for (const auto baud : given.bauds)
    for (const auto axes : given.axes.empty() ? std::vector{1, 2, 4, 8, 16, 30} : given.axes) {
      auto found = measure(given, axes, baud);
      const auto raw_moves = std::min(enough, given.numbers.at("--moves"));
      const auto apart = RawScript(found.raw).rate(raw_moves);
      found.raw.start = RawScript::Start::one;
      const auto one = RawScript(found.raw).rate(raw_moves);
      std::string kinds;
      double all = 0;
      for (const auto* purpose : purposes) {
        kinds += fmt::format(" {:.2f}", found.exchanges[purpose]);
        all += found.exchanges[purpose];
      }
      fmt::print(
          "{:>6} {:>4} {:>8.2f} {:>8.2f} {:>8.2f} {:>6.3f} {:>6.3f}  {:<42} {:>7.2f} {:>9.1f} {:>9.1f} "
          "{:>7} {:>6}{}\n",
          baud, axes, found.rate, apart, one, found.rate / apart, found.rate / one,
          fmt::format("{:.2f}:{}", all, kinds), found.deviation * 100, ms(found.wait), ms(found.bound),
          found.refused, found.failed, is_good(found) ? "" : "  NOT MET");
      for (const auto& failure : found.failures) fmt::print("  {}\n", failure);
      good = good && is_good(found);
    }
  return good;
}

namespace {

/// Stops one axis of a line after the other, at times that have nothing to do with what is on the wire.
class Stopping {
 public:
  Stopping(Line& line, test::IndexingAxes& axes, long count)
      : line_(&line), axes_(&axes), left_(count), asked_(axes.count()) {
    line.wire.on_request = [this](const test::WireEntry& request, Purpose purpose) {
      auto& asked = asked_.at(request.node() - std::size_t{1});
      if (purpose == Purpose::stop && asked != TimePoint{}) taken.add(request.end - std::exchange(asked, {}));
    };
    wait();
  }
  ~Stopping() { line_->wire.on_request = {}; }
  Stopping(const Stopping&) = delete;
  [[nodiscard]] bool over() const { return left_ == 0; }
  [[nodiscard]] long lost() const {
    return std::ranges::count_if(asked_, [](auto at) { return at != TimePoint{}; });
  }

  Times taken;  ///< from arrival to the last byte of the stop frame

 private:
  void wait() {
    const auto pause = 200ms + Duration(random_() % Duration(200ms).count());
    next_ = line_->shared.world.clock().call_at(line_->now() + pause, [this] {
      const auto axis = random_() % axes_->count();
      asked_[axis] = line_->now();
      axes_->stop(axis);
      if (--left_ > 0) wait();
    });
  }
  Line* line_;
  test::IndexingAxes* axes_;
  long left_;
  std::vector<TimePoint> asked_;
  std::mt19937_64 random_{1};
  Clock::Timer next_;
};

bool stops_on(const Given& given, int axes, int baud, Polls polls) {
  Line line(given, axes, baud, polls);
  test::IndexingAxes indexing(line.shared.world, line.shared.machine(), names(1, axes),
                              {.near = near_mm, .far = far_mm});
  const bool reads_only = polls == Polls::as_fast_as_they_go;
  const auto go_on = [&](Duration time) {
    if (reads_only)
      line.shared.world.run_for(time);
    else
      indexing.run(time);
  };
  go_on(2s);
  Stopping stopping(line, indexing, given.numbers.at("--stops"));
  while (!stopping.over()) go_on(1s);
  go_on(1s);
  const auto bound = line.budget().axes.front().predicted.alone.last_frame;
  auto& taken = stopping.taken;
  const bool met = taken.at(1) <= ms(bound) && stopping.lost() == 0 && indexing.failed == 0;
  fmt::print("{:>6} {:>4} {:<9} {:>6} {:>9.2f} {:>9.2f} {:>9.2f} {:>9.2f} {:>7}{}\n", baud, axes,
             reads_only ? "readings" : "indexing", taken.all.size(), taken.at(0.5), taken.at(0.99),
             taken.at(1), ms(bound), indexing.failed, met ? "" : "  NOT MET");
  for (const auto& failure : indexing.failures) fmt::print("  {}\n", failure);
  return met;
}

}  // namespace

bool stops(const Given& given) {
  fmt::print(
      "from a stop's arrival to the last byte of its frame, ms, and the published bound of one axis\n");
  fmt::print("{:>6} {:>4} {:<9} {:>6} {:>9} {:>9} {:>9} {:>9} {:>7}\n", "baud", "axes", "line", "stops",
             "median", "99 %", "longest", "bound", "failed");
  bool good = true;
  for (const auto baud : given.bauds)
    for (const auto axes : given.axes.empty() ? std::vector{16} : given.axes)
      for (const auto polls : {Polls::as_configured, Polls::as_fast_as_they_go})
        good = stops_on(given, axes, baud, polls) && good;
  return good;
}

namespace {

/// Looks at the drives themselves, again and again: since when each stands.
class Standing {
 public:
  static constexpr Duration period = 100us;
  explicit Standing(Line& line, std::size_t axes) : line_(&line), moving_(axes), since_(axes) { look(); }
  Standing(const Standing&) = delete;
  /// Since the end of the motion that was seen last; TimePoint{}: none was. Once.
  TimePoint take(std::size_t axis) { return std::exchange(since_.at(axis), {}); }

 private:
  void look() {
    line_->shared.line->network().advance(line_->now());
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const bool moves = line_->drive(i).shaft_moving();
      if (moving_[i] != 0 && !moves) since_[i] = line_->now();
      moving_[i] = moves ? 1 : 0;
    }
    next_ = line_->shared.world.clock().call_at(line_->now() + period, [this] { look(); });
  }
  Line* line_;
  std::vector<char> moving_;
  std::vector<TimePoint> since_;
  Clock::Timer next_;
};

}  // namespace

bool done(const Given& given) {
  fmt::print(
      "from a drive's standstill (seen each 0.1 ms) to its command's end, in transactions (readings of the\n"
      "state), of moves of 0.2 to 5 mm\n");
  fmt::print("{:>6} {:>4} {:>15} {:>6} {:>8} {:>9} {:>9} {:>9} {:>7}\n", "baud", "axes", "transaction, ms",
             "moves", "moves/s", "median", "99 %", "longest", "failed");
  bool good = true;
  for (const auto baud : given.bauds)
    for (const auto axes : given.axes.empty() ? std::vector{4} : given.axes) {
      Line line(given, axes, baud);
      test::IndexingAxes indexing(
          line.shared.world, line.shared.machine(), names(1, axes),
          {.near = 0, .far = 2.5, .spread = 2.3, .pause = given.numbers.at("--pause") * Duration(1ms)});
      Standing standing(line, indexing.count());
      Times taken;
      indexing.on_end = [&](std::size_t axis, const Command& move) {
        const auto since = standing.take(axis);
        if (since != TimePoint{} && move.state == CommandState::done) taken.add(line.now() - since);
      };
      const auto begin = line.now();
      indexing.run_moves(given.numbers.at("--moves"));
      const auto seconds = std::chrono::duration<double>(line.now() - begin).count();
      const auto unit = ms(reading(*line.shared.line, baud));
      fmt::print("{:>6} {:>4} {:>15.2f} {:>6} {:>8.1f} {:>9.2f} {:>9.2f} {:>9.2f} {:>7}\n", baud, axes, unit,
                 taken.all.size(), static_cast<double>(indexing.all_done()) / seconds, taken.at(0.5) / unit,
                 taken.at(0.99) / unit, taken.at(1) / unit, indexing.failed);
      for (const auto& failure : indexing.failures) fmt::print("  {}\n", failure);
      good = good && indexing.failed == 0;
    }
  return good;
}

namespace {

struct GroupStarts {
  TimePoint first{}, last{};  ///< last bytes of start frames
  long blocks = 0, triggers = 0;
};

/// Members move to and fro once, while `others` index.
GroupStarts move_group(Line& line, test::IndexingAxes& others, int members, double target) {
  GroupStarts seen;
  line.wire.on_request = [&](const test::WireEntry& request, Purpose purpose) {
    if (request.node() > members) return;
    if (purpose == Purpose::block || purpose == Purpose::one) ++seen.blocks;
    if (!starts(purpose)) return;
    ++seen.triggers;
    seen.last = request.end;
    if (seen.first == TimePoint{}) seen.first = request.end;
  };
  GroupMoveRequest request;
  for (const auto& name : names(1, members)) request.targets.push_back({.axis = name, .position = target});
  auto run = line.shared.machine().groups().move(request, {.arrived = line.now()});
  for (int again = 100; again > 0 && !run; --again) {  // the line is too full just now
    others.run(20ms);
    run = line.shared.machine().groups().move(request, {.arrived = line.now()});
  }
  if (!run) throw std::runtime_error(to_string(run.error()));
  for (int left = 60'000; left > 0 && !axisd::ended((*run)->state()); --left) others.run(1ms);
  line.wire.on_request = {};
  if ((*run)->state() != CommandState::done) {
    const auto cause = (*run)->value().cause;
    throw std::runtime_error(
        fmt::format("a group of {}: {}", members, cause ? to_string(*cause) : "not done"));
  }
  return seen;
}

}  // namespace

bool groups(const Given& given) {
  constexpr int axes = 16;
  fmt::print(
      "groups on a line of {} axes, the others index: longest skew between the last bytes of the first and\n"
      "the last start frame; the wire's share: so many triggers less one; blocks and triggers of {} moves\n",
      axes, given.numbers.at("--rounds"));
  fmt::print("{:>6} {:>7} {:>9} {:>9} {:>9} {:>7} {:>8}\n", "baud", "members", "skew, ms", "wire, ms",
             "skew/wire", "blocks", "triggers");
  bool good = true;
  for (const auto baud : given.bauds)
    for (int members = 2; members <= axes; ++members) {
      Line line(given, axes, baud);
      test::IndexingAxes others(line.shared.world, line.shared.machine(), names(members + 1, axes));
      Duration skew{};
      long blocks = 0, triggers = 0;
      const auto rounds = given.numbers.at("--rounds");
      for (long round = 0; round < rounds; ++round) {
        const auto seen = move_group(line, others, members, round % 2 == 0 ? 1 : 0);
        skew = std::max(skew, seen.last - seen.first);
        blocks += seen.blocks;
        triggers += seen.triggers;
      }
      const bool once = blocks == triggers && triggers == rounds * members && others.failed == 0;
      const auto wire = (members - 1) * trigger(*line.shared.line, baud);
      fmt::print("{:>6} {:>7} {:>9.2f} {:>9.2f} {:>9.2f} {:>7} {:>8}{}\n", baud, members, ms(skew), ms(wire),
                 ms(skew) / ms(wire), blocks, triggers, once ? "" : "  NOT MET");
      for (const auto& failure : others.failures) fmt::print("  {}\n", failure);
      good = good && once;
    }
  return good;
}

}  // namespace axisd::bench
