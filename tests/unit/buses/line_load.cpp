#include "tests/unit/buses/line_load.hpp"

#include <algorithm>
#include <chrono>

namespace axisd::modbus_rtu::test {

namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t first_register = 0x20, stop_register = 0x50;

/// A request of this size.
Request request_of(std::uint8_t node, std::uint16_t address, ExchangeSize size) {
  Request request{.node = node, .address = address};
  if (size == ExchangeSize{}) {
    request.function = Function::write_single_register;
    request.values = {1};
  } else if (size.request == 8) {
    request.count = static_cast<std::uint16_t>((size.reply - 5) / 2);
  } else {
    request.function = Function::write_multiple_registers;
    request.count = static_cast<std::uint16_t>((size.request - 9) / 2);
    request.values.assign(request.count, 1);
  }
  return request;
}

}  // namespace

LineLoad::LineLoad(LineDemand demand, unsigned seed, int silent) : demand_(std::move(demand)), engine_(seed) {
  auto line = std::make_unique<VirtualLine>(world_, demand_.line);
  line_ = line.get();
  std::map<std::uint16_t, std::uint16_t> registers;
  for (std::uint16_t address = first_register; address <= stop_register; ++address) registers[address] = 0;
  for (std::size_t i = 0; i < demand_.axes.size(); ++i) {
    auto& axis = *axes.emplace_back(std::make_unique<LoadedAxis>(world_));
    axis.node = static_cast<std::uint8_t>(i + 1);
    auto node = std::make_unique<RegisterNode>(axis.node, registers);
    nodes_.push_back(node.get());
    line_->network().add(std::move(node));
  }
  silence_last(silent);
  line_->set_on_bind([this](const WireEntry& entry) { on_bind(entry); });
  bus_ = std::make_unique<RtuBus>(world_.executor(), world_.clock(), demand_.line, std::move(line));
  for (std::size_t i = 0; i < demand_.axes.size(); ++i)
    if (const auto own = demand_.axes[i].turnaround_max) bus_->set_turnaround_max(axes[i]->node, *own);
  bus_->start();
  world_.run_for(10ms);
}

void LineLoad::silence_last(int silent) {
  for (std::size_t i = axes.size() - static_cast<std::size_t>(silent); i < axes.size(); ++i)
    axes[i]->silent = nodes_[i]->silent = true;
}

LineLoad::~LineLoad() {
  closing_ = true;
  for (const auto& axis : axes) axis->wake.notify_all();
  bus_->close();  // ends also what is held back from a silent node
  world_.run_for(10s);
}

/// Each reply comes as late as it may, or nearly, or sooner.
void LineLoad::on_bind(const WireEntry& entry) {
  const Duration by_itself = std::max<Duration>(2ms, silence(demand_.line));
  const auto spare = bus_->turnaround_max(entry.node()) - by_itself;
  const auto late = random(0, 2) == 0 ? spare : spare * random(0, 100) / 100;
  line_->network().faults().clear();
  line_->network().faults().add({.kind = simulation::FaultKind::delay_reply, .delay = late});
  if (const auto found = deadlines_.find(entry.address());
      found != deadlines_.end() && entry.begin > found->second)
    ++late_frames;
  if (entry.address() != stop_register) return;
  auto& axis = *axes.at(entry.node() - 1U);
  if (!axis.stop_sent) axis.stop_sent = entry.begin + wire_time(demand_.line, entry.request.size());
}

Task<bool> LineLoad::exchange(std::uint8_t node, std::uint16_t address, ExchangeSize size,
                              TransactionOptions options, Answer* answer) {
  const auto transaction_class = options.transaction_class;
  auto result = co_await bus_->transact(request_of(node, address, size), std::move(options));
  const bool refused = !result && result.error().reason == Reason::refused;
  if (result || refused) ++completed[transaction_class];
  if (result && answer != nullptr) *answer = std::move(*result);
  co_return result.has_value();
}

Task<> LineLoad::poll(LoadedAxis& axis, const AxisDemand& demand) {
  while (!closing_) {
    if (axis.chains > 0) {
      co_await axis.wake.wait();
      continue;
    }
    const auto began = world_.now();
    const auto options = [&axis] {
      return TransactionOptions{.transaction_class = axis.moving || axis.stopping
                                                         ? TransactionClass::moving_state
                                                         : TransactionClass::idle_state};
    };
    bool answered = true;
    if (!axis.last_continuity || began - *axis.last_continuity >= demand.continuity_period) {
      answered = co_await exchange(axis.node, first_register, demand.set.continuity, options());
      if (answered) axis.last_continuity = world_.now();
    }
    Answer answer;
    if (answered) {
      auto state = options();
      if (std::exchange(axis.end_is_near, false)) state.awaited_from = began;
      answered = co_await exchange(axis.node, first_register, demand.set.state, std::move(state), &answer);
    }
    if (answered) {
      if (axis.last_asked)
        axis.longest_refresh = std::max(axis.longest_refresh, answer.sent_at - *axis.last_asked);
      // During a start nothing is polled: it looks by itself.
      if (axis.chains == 0)
        axis.last_asked = answer.sent_at;
      else
        axis.last_asked.reset();
      if (axis.stop_acknowledged && !axis.standstill && answer.sent_at >= *axis.stop_acknowledged)
        axis.standstill = answer.answered_at;
    }
    co_await axis.wake.wait_until(began + (axis.stopping ? demand.poll_fastest
                                           : axis.moving ? demand.poll_moving
                                                         : demand.poll_idle));
  }
}

/// Each axis starts at most once while another waits for one reading.
Task<> LineLoad::start_now_and_then(LoadedAxis& axis, const AxisDemand& demand) {
  while (!closing_) {
    co_await sleep_until(world_.executor(), world_.clock(), world_.now() + random(4000, 9000) * 1ms);
    if (closing_) co_return;
    if (axis.stopping) continue;
    ++axis.chains;
    axis.last_asked.reset();
    // In its turn, so that it gives way to readings; and as if nobody had turns.
    StartTurns::Turn turn;
    if (random(0, 1) == 0) {
      turn = bus_->start_turns()->announce();
      co_await bus_->start_turns()->take(turn);
    }
    const MotionGuard guard{.gate = axis.gate, .epoch = axis.gate->epoch()};
    for (const auto one : demand.set.start)
      if (!co_await exchange(axis.node, first_register, one,
                             {.transaction_class = TransactionClass::motion, .guard = guard}))
        break;
    --axis.chains;
    axis.end_is_near = true;
    axis.wake.notify_all();
  }
}

/// As fast as it can, some of it with deadlines that cannot be met.
Task<> LineLoad::ask_without_end(std::uint8_t node, TransactionClass transaction_class) {
  while (!closing_) {
    TransactionOptions options{.transaction_class = transaction_class};
    const auto address = ++last_address_;
    if (random(0, 3) == 0) {
      options.deadline = world_.now() + random(0, 400) * 1ms;
      deadlines_[address] = options.deadline;
    }
    const bool own = options.deadline != TimePoint::max();
    co_await exchange(node, own ? address : first_register, reading(16), std::move(options));
    deadlines_.erase(address);
    if (random(0, 9) == 0)
      co_await sleep_until(world_.executor(), world_.clock(), world_.now() + random(1, 80) * 1ms);
  }
}

void LineLoad::begin(int moving, bool starting) {
  for (std::size_t i = 0; i < axes.size(); ++i) {
    auto& axis = *axes[i];
    axis.moving = static_cast<int>(i) < moving;
    spawn(world_.executor(), poll(axis, demand_.axes[i]), "poll");
    if (axis.moving && starting)
      spawn(world_.executor(), start_now_and_then(axis, demand_.axes[i]), "starts");
    spawn(world_.executor(), ask_without_end(axis.node, TransactionClass::parameters), "parameters");
  }
  spawn(world_.executor(),
        ask_without_end(static_cast<std::uint8_t>(axes.size() + 1), TransactionClass::scan), "scan");
}

/// As an axis does: a stop without a reply is sent again, twice.
Task<> LineLoad::send_stop(LoadedAxis& axis) {
  for (int attempt = 0; attempt < 3; ++attempt) {
    Answer answer;
    if (!co_await exchange(axis.node, stop_register, {}, {.transaction_class = TransactionClass::stop},
                           &answer))
      continue;
    axis.stop_acknowledged = answer.answered_at;
    break;
  }
  axis.wake.notify_all();
}

LineLoad::Stopped LineLoad::stop(const std::vector<std::size_t>& which) {
  const auto asked = world_.now();
  for (const auto i : which) {
    auto& axis = *axes[i];
    axis.stop_sent = axis.stop_acknowledged = axis.standstill = std::nullopt;
    axis.stopping = true;
    axis.gate->raise();
    bus_->purge_superseded(axis.node, *axis.gate);
    bus_->hasten(axis.node, TransactionClass::moving_state);
    spawn(world_.executor(), send_stop(axis), "stop");
  }
  world_.run_until(
      [&] {
        return std::ranges::all_of(which, [&](std::size_t i) {
          return axes[i]->stop_sent && (axes[i]->silent || axes[i]->standstill);
        });
      },
      60s);
  Stopped stopped;
  for (const auto i : which) {
    auto& axis = *axes[i];
    stopped.last_frame = std::max(stopped.last_frame, axis.stop_sent.value_or(TimePoint::max()) - asked);
    if (!axis.silent)
      stopped.last_answering =
          std::max(stopped.last_answering, axis.stop_sent.value_or(TimePoint::max()) - asked);
    if (!axis.silent)
      stopped.standstill = std::max(stopped.standstill, axis.standstill.value_or(TimePoint::max()) - asked);
    axis.stopping = false;
  }
  return stopped;
}

}  // namespace axisd::modbus_rtu::test
