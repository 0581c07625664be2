// Response times of a non-preemptive queue with fixed priorities (budget.md).
#include "buses/budget_rtu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <span>

#include "buses/modbus_rtu/transaction_queue.hpp"

namespace axisd::modbus_rtu {
namespace {

/// Response times beyond this are no bound that anybody could use.
constexpr Duration longest_bound = std::chrono::seconds(600);
/// A function 03 of 125 registers, which Transact may ask for.
constexpr ExchangeSize longest_of_all = reading(125);

double rate(Duration period) { return 1.0 / std::chrono::duration<double>(period).count(); }
std::int64_t ceiling(Duration time, Duration period) { return (time + period - Duration(1)) / period; }

std::vector<ExchangeSize> drift_of(const AxisDemand& axis) {
  std::vector<ExchangeSize> all(axis.set.drift.begin(), axis.set.drift.end());
  if (axis.segments)
    all.insert(all.end(), axis.set.drift_of_segments.begin(), axis.set.drift_of_segments.end());
  return all;
}

class Analysis {
 public:
  explicit Analysis(const LineDemand& demand);
  [[nodiscard]] LoadBudget load(int moving) const;
  [[nodiscard]] StopBudget stop(const AxisDemand& last, int axes) const;
  [[nodiscard]] AxisBudget axis(const AxisDemand& axis) const;
  /// Why bounds are long on a line whose axes rest, and that would have time to spare if its nodes answered
  /// at once; empty: it has time to spare either way.
  [[nodiscard]] std::string note_on_turnaround() const;
  [[nodiscard]] std::string note_on_transact() const;

 private:
  [[nodiscard]] int count() const { return static_cast<int>(demand_.axes.size()); }
  [[nodiscard]] Duration wire(std::size_t characters) const { return wire_time(demand_.line, characters); }
  /// Of an axis or a device.
  [[nodiscard]] Duration turnaround(const auto& node) const {
    return node.turnaround_max.value_or(demand_.line.turnaround_max);
  }
  /// From the first byte of the request to the last of a reply that comes as late as it may.
  [[nodiscard]] Duration answered(ExchangeSize one, Duration turnaround_max) const {
    return wire(one.request) + turnaround_max + wire(one.reply);
  }
  [[nodiscard]] Duration answered(ExchangeSize one, const AxisDemand& axis) const {
    return answered(one, turnaround(axis));
  }
  /// What an exchange costs those behind it.
  [[nodiscard]] Duration cost(ExchangeSize one, const AxisDemand& axis) const {
    return silence(demand_.line) + answered(one, axis);
  }
  [[nodiscard]] Duration cost(std::span<const ExchangeSize> all, const AxisDemand& axis) const;
  /// The sum over all axes but one, the cheapest, of the `among` dearest.
  [[nodiscard]] Duration dearest(std::size_t among,
                                 const std::function<Duration(const AxisDemand&)>& of) const;
  [[nodiscard]] Duration reservations(std::int64_t overtaking) const;
  [[nodiscard]] Duration wait_moving(int moving, int starting, Duration late) const;
  [[nodiscard]] Duration wait_idle(int moving) const;
  [[nodiscard]] Duration start(int starting) const;
  [[nodiscard]] Duration refresh(const AxisDemand& axis, Duration period, Duration wait) const;
  [[nodiscard]] Duration refresh_moving(const AxisDemand& axis, Duration wait) const {
    return refresh(axis, std::max(axis.poll_moving, axis.quiet_before_end), wait);
  }
  [[nodiscard]] Duration refresh_idle(const AxisDemand& axis, Duration wait) const;
  [[nodiscard]] double utilisation(int moving, bool slow) const;

  const LineDemand& demand_;
  Duration slowest_;      ///< turnaround_max of the node that has the longest
  Duration in_flight_{};  ///< rest of what was bound just before, if it is answered
  Duration late_{};       ///< what nodes that stay silent cost more than ones that answer late
  std::int64_t longest_chain_ = 0;
};

Analysis::Analysis(const LineDemand& demand)
    : demand_(demand), slowest_(demand.line.turnaround_max), late_(demand.silent_nodes * reply_margin) {
  const auto also = [this](ExchangeSize one, const auto& node) {
    slowest_ = std::max(slowest_, turnaround(node));
    in_flight_ = std::max(in_flight_, answered(one, turnaround(node)));
  };
  for (const auto& axis : demand.axes) {
    for (const auto one : {axis.set.state, axis.set.continuity, axis.set.stop, axis.set.longest})
      also(one, axis);
    longest_chain_ = std::max(longest_chain_, std::ssize(axis.set.start));
  }
  for (const auto& device : demand.devices)
    for (const auto one : device.blocks) also(one, device);
}

Duration Analysis::cost(std::span<const ExchangeSize> all, const AxisDemand& axis) const {
  Duration sum{};
  for (const auto one : all) sum += cost(one, axis);
  return sum;
}

Duration Analysis::dearest(std::size_t among, const std::function<Duration(const AxisDemand&)>& of) const {
  std::vector<Duration> costs;
  costs.reserve(demand_.axes.size());
  for (const auto& axis : demand_.axes) costs.push_back(of(axis));
  std::ranges::sort(costs, std::greater{});
  Duration sum{};
  for (std::size_t i = 0; i < std::min(among, costs.size()); ++i) sum += costs[i];
  return sum;
}

/// Of every `reservation` that overtake, one more comes from below; the first at once.
Duration Analysis::reservations(std::int64_t overtaking) const {
  const auto reserved = overtaking / (TransactionQueue::default_reservation - 1) + 1;
  return reserved * (silence(demand_.line) + in_flight_ + late_);
}

/// From the queue to the first byte, in class moving_state, whose order is that of arrival. Each other axis
/// has at most one exchange before it, also one that was hastened, and one chain, which begins with a
/// reading: it starts again only when it was read behind this one. Silent nodes may have to be stopped again.
/// `late`: what silent ones among them cost more than ones that answer late.
Duration Analysis::wait_moving(int moving, int starting, Duration late) const {
  const auto others = static_cast<std::size_t>(std::max(0, moving - 1));
  const auto chains = std::min(others, static_cast<std::size_t>(starting));
  const auto poll = [this](const AxisDemand& axis) { return cost(axis.set.state, axis); };
  const auto chain = [this](const AxisDemand& axis) {
    const auto state = cost(axis.set.state, axis);
    return 2 * state + cost(axis.set.start, axis) +
           std::max(Duration{}, cost(axis.set.longest, axis) - state);
  };
  const auto overtaking = static_cast<std::int64_t>(others - chains) +
                          static_cast<std::int64_t>(chains) * (longest_chain_ + 2) + 1;
  return in_flight_ + late_ + dearest(chains, chain) + dearest(others - chains, poll) + late +
         reservations(overtaking) + silence(demand_.line);
}

/// The same in class idle_state: everything that moves goes first, as often as it is asked. Where that takes
/// the whole line, the reservation alone lets it through, in turn with the three other classes below motion.
Duration Analysis::wait_idle(int moving) const {
  const auto idle = std::max(1, count() - moving);
  const auto polled = dearest(static_cast<std::size_t>(moving),
                              [this](const AxisDemand& axis) { return cost(axis.set.state, axis); });
  const auto of_class = dearest(static_cast<std::size_t>(idle - 1),
                                [this](const AxisDemand& axis) { return cost(axis.set.longest, axis); });
  const auto chains = dearest(static_cast<std::size_t>(moving),
                              [this](const AxisDemand& axis) { return cost(axis.set.start, axis); });
  const auto always = in_flight_ + 2 * late_ + of_class + chains + silence(demand_.line);
  auto fastest = Duration::max();
  for (const auto& axis : demand_.axes) fastest = std::min(fastest, axis.poll_fastest);
  constexpr int classes_below_motion = 4;
  const auto by_reservation = always + std::int64_t{idle} * classes_below_motion *
                                           TransactionQueue::default_reservation *
                                           (silence(demand_.line) + in_flight_ + late_);
  auto wait = always;
  while (wait < by_reservation) {
    const auto polls = moving == 0 ? 0 : ceiling(wait, fastest) + 1;
    const auto overtaking = idle + moving * (polls + longest_chain_);
    const auto next = always + polls * polled + reservations(overtaking);
    if (next == wait) return wait;
    wait = next;
  }
  return std::min(wait, by_reservation);
}

/// Each has its turn: it is read, then comes its chain. Before it has it, it may be read once, too; and its
/// turn gives way to a reading of any axis.
Duration Analysis::start(int starting) const {
  const auto turn = [this](const AxisDemand& axis) {
    return 2 * cost(axis.set.state, axis) + cost(axis.set.start, axis);
  };
  const auto reading = dearest(1, [this](const AxisDemand& axis) {
    return std::max(
        {cost(axis.set.state, axis), cost(axis.set.continuity, axis), cost(axis.set.longest, axis)});
  });
  const auto first = starting + static_cast<std::int64_t>(most_that_go_first);
  return in_flight_ + late_ + dearest(static_cast<std::size_t>(starting), turn) + first * reading +
         reservations(starting * (longest_chain_ + 2) + first);
}

/// One reading may be preceded by the canary; the next one is asked for a period after the last, or at once.
Duration Analysis::refresh(const AxisDemand& axis, Duration period, Duration wait) const {
  return std::max(period, answered(axis.set.state, axis)) + wait + answered(axis.set.continuity, axis) + wait;
}

Duration Analysis::refresh_idle(const AxisDemand& axis, Duration wait) const {
  auto busy = answered(axis.set.state, axis);
  for (const auto one : drift_of(axis)) busy += wait + answered(one, axis);
  return std::max(axis.poll_idle, busy) + wait + answered(axis.set.continuity, axis) + wait;
}

double Analysis::utilisation(int moving, bool slow) const {
  // Before a reply a node is silent for as long as the master before a request.
  const auto busy = [&](ExchangeSize one, const auto& node) {
    const auto wait = slow ? turnaround(node) : silence(demand_.line);
    return std::chrono::duration<double>(silence(demand_.line) + answered(one, wait)).count();
  };
  double sum = 0;
  int left = moving;
  for (const auto& axis : demand_.axes) {
    const bool moves = left-- > 0;
    sum += busy(axis.set.state, axis) * rate(moves ? axis.poll_moving : axis.poll_idle);
    sum += busy(axis.set.continuity, axis) * rate(axis.continuity_period);
    if (moves) continue;
    for (const auto one : drift_of(axis)) sum += busy(one, axis) * rate(axis.drift_check);
  }
  for (const auto& device : demand_.devices)
    for (const auto one : device.blocks) sum += busy(one, device) * rate(device.poll);
  return sum;
}

LoadBudget Analysis::load(int moving) const {
  LoadBudget load{.moving = moving,
                  .utilisation = utilisation(moving, false),
                  .utilisation_max = utilisation(moving, true)};
  const auto wait_while_moving = wait_moving(moving, moving - 1, late_), wait_while_idle = wait_idle(moving);
  for (const auto& axis : demand_.axes) {
    if (moving > 0)
      load.refresh_moving = std::max(load.refresh_moving, refresh_moving(axis, wait_while_moving));
    if (moving < count())
      load.refresh_idle = std::max(load.refresh_idle, refresh_idle(axis, wait_while_idle));
  }
  const auto sensible = [](Duration time) { return time > longest_bound ? Duration::max() : time; };
  load.refresh_moving = sensible(load.refresh_moving);
  load.refresh_idle = sensible(load.refresh_idle);
  if (moving > 0) load.start = sensible(start(moving));
  return load;
}

/// A stop overtakes all but what is under way, which it cuts at turnaround_max; so does each stop with the
/// one before it. That is what a late answer may take, too: it does not matter how many nodes are silent.
StopBudget Analysis::stop(const AxisDemand& last, int axes) const {
  const auto stops = [this](const AxisDemand& axis) { return cost(axis.set.stop, axis); };
  const auto others = static_cast<std::size_t>(axes - 1);
  StopBudget stop{.axes = axes};
  stop.last_frame = demand_.line.budget.host_allowance + in_flight_ + dearest(others, stops) +
                    silence(demand_.line) + wire(last.set.stop.request);
  const auto acknowledged = turnaround(last) + wire(last.set.stop.reply);
  // Those that do not answer are told again: twice, and once they are offline. Nothing need cut that.
  const auto in_vain = [&](const AxisDemand& axis) { return stops(axis) + reply_margin; };
  const auto told_again = 3 * dearest(std::max(others, std::size_t{1}), in_vain);
  // The first reading after the shaft rests; it may be asked for just before. Whatever is not stopped may
  // start. What waits for a stopping axis anyway is hastened.
  const auto hastened = dearest(static_cast<std::size_t>(axes),
                                [this](const AxisDemand& axis) { return cost(axis.set.longest, axis); });
  const auto wait = wait_moving(count(), count() - axes, std::max(1, count() - 1) * reply_margin);
  stop.standstill = stop.last_frame + acknowledged + refresh(last, last.poll_moving, wait) + told_again +
                    hastened + answered(last.set.state, last);
  return stop;
}

AxisBudget Analysis::axis(const AxisDemand& axis) const {
  return {.axis = axis.name,
          .refresh_idle = refresh_idle(axis, wait_idle(count() - 1)),
          .refresh_moving = refresh_moving(axis, wait_moving(1, 0, late_)),
          .refresh_moving_all = refresh_moving(axis, wait_moving(count(), count() - 1, late_)),
          .alone = stop(axis, 1),
          .all = stop(axis, count())};
}

std::string Analysis::note_on_turnaround() const {
  const auto at_most = utilisation(0, true);
  if (at_most <= 1 || utilisation(0, false) > 1) return {};
  Duration slowest{};
  for (const auto& axis : demand_.axes) slowest = std::max(slowest, turnaround(axis));
  for (const auto& device : demand_.devices) slowest = std::max(slowest, turnaround(device));
  return fmt::format(
      "all bounds presume that each reply takes its turnaround_max (up to {}): even while all axes rest, "
      "reading everything as often as configured would then take {:.0f} % of the wire's time; lower "
      "turnaround_max to what the drives need",
      bound_text(slowest), 100 * at_most);
}

std::string Analysis::note_on_transact() const {
  return fmt::format("while somebody reads 125 registers at once over the API, a stop may take {} more",
                     bound_text(answered(longest_of_all, slowest_) - in_flight_));
}

}  // namespace

BusBudget budget_of(const LineDemand& demand) {
  const Analysis analysis(demand);
  BusBudget budget{.bus = demand.line.name};
  const auto count = static_cast<int>(demand.axes.size());
  for (int moving = 0; moving <= count; ++moving) budget.load.push_back(analysis.load(moving));
  for (int axes = 1; axes <= count; ++axes) {
    StopBudget worst{.axes = axes};
    for (const auto& axis : demand.axes) {
      const auto stop = analysis.stop(axis, axes);
      worst.last_frame = std::max(worst.last_frame, stop.last_frame);
      worst.standstill = std::max(worst.standstill, stop.standstill);
    }
    budget.stops.push_back(worst);
  }
  for (const auto& axis : demand.axes) budget.axes.push_back(analysis.axis(axis));
  if (auto note = analysis.note_on_turnaround(); !note.empty()) budget.notes.push_back(std::move(note));
  budget.notes.push_back(analysis.note_on_transact());
  return budget;
}

}  // namespace axisd::modbus_rtu
