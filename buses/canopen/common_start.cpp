#include "buses/canopen/common_start.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "buses/canopen/canopen_bus.hpp"
#include "buses/signal.hpp"

namespace axisd::canopen {

namespace {

/// So long before the moment of the SYNC the first node is armed, and so much longer for each: one frame
/// takes less, down to 125 kbit/s.
constexpr auto arming_time = std::chrono::milliseconds(2), arming_of_one = std::chrono::milliseconds(1);
/// Before that cycles are held: one that is on its way ends within this.
constexpr auto hold_time = std::chrono::milliseconds(2);

/// What must not change between the first frame that arms a node and the end of the SYNC.
struct Surroundings {
  std::uint64_t losses = 0, unknown = 0, overflows = 0;
  bool operator==(const Surroundings&) const = default;
};

/// One run. The members are armed back to back, then comes the SYNC. While a node is armed, no other SYNC
/// goes out; when it ends otherwise than with the node's own word that it took the SYNC, it stays so.
class CommonStart {
 public:
  CommonStart(CanopenBus& bus, std::vector<SyncStart> members, TimePoint not_before)
      : bus_(&bus), members_(std::move(members)), not_before_(not_before) {}

  Task<Result<TimePoint>> run() {
    const auto armed_from = not_before_ - arming_time - arming_of_one * members_.size();
    co_await pause_until(armed_from - hold_time);
    const auto hold = co_await bus_->hold_sync();
    co_await pause_until(armed_from);
    if (auto objection = bus_->objection_to_sync()) co_return fail(std::move(*objection));
    before_ = surroundings();
    foreign_syncs_ = bus_->master().counters().foreign_syncs;
    co_await at_once([this](std::size_t i) { return arm(i); });
    Result<TimePoint> started = TimePoint{};
    if (!error_) co_await pause_until(not_before_);
    if (!error_ && disturbed()) note(*disturbed());
    if (!error_) {
      started = co_await bus_->send_sync(for_all());
      if (!started) note(started.error());
      if (started) co_await at_once([this](std::size_t i) { return confirm(i); });
    }
    if (auto disturbance = disturbed()) note(std::move(*disturbance));
    co_await at_once([this](std::size_t i) { return neutralise(i); });
    if (error_) co_return fail(std::move(*error_));
    co_return started;
  }

 private:
  Task<> at_once(std::function<Task<>(std::size_t)> what) {
    return for_each_at_once(bus_->executor(), bus_->clock(), members_.size(), std::move(what));
  }

  Task<> pause_until(TimePoint when) {
    if (bus_->clock().now() < when) co_await sleep_until(bus_->executor(), bus_->clock(), when);
  }

  [[nodiscard]] Surroundings surroundings() const {
    const auto& port = bus_->master().port().counters();
    return {.losses = bus_->losses(), .unknown = port.unknown, .overflows = port.receive_overflows};
  }

  /// After a SYNC that is not ours armed nodes may run; after lost frames nobody knows.
  [[nodiscard]] std::optional<Error> disturbed() const {
    Error error{.reason = Reason::not_confirmed,
                .message = "frames of the network were lost during a common start",
                .remedy = "check the wiring and the load of the network and of this computer",
                .outcome = Outcome::unknown,
                .where = {.bus = bus_->name()}};
    if (bus_->master().counters().foreign_syncs != foreign_syncs_) {
      error.message = "another SYNC came while the drives were armed for a common start";
      error.remedy = "switch the other SYNC producer off";
      return error;
    }
    if (surroundings() != before_) return error;
    return std::nullopt;
  }

  /// The first error counts, but what is not known counts more.
  void note(Error error) {
    const bool unknown = error.outcome == Outcome::unknown;
    if (!error_ || (unknown && error_->outcome != Outcome::unknown)) error_ = std::move(error);
    // What is still queued for the other members is not sent any more.
    together_->raise();
    for (const auto& member : members_) bus_->purge_superseded(member.node, *together_);
  }

  Task<> arm(std::size_t index) {
    auto& member = members_[index];
    can::SendOptions options{.transaction_class = TransactionClass::motion, .more_guards = member.guards};
    options.more_guards.push_back(together());
    bus_->set_armed(member.node, true);
    auto sent = co_await bus_->send_waiting(member.node, member.cob_id, member.arm, std::move(options));
    if (sent) co_return;
    auto error = std::move(sent.error());
    error.where.node = member.node;
    if (error.outcome == Outcome::unknown)
      error.outcome = Outcome::not_executed;  // it waits there, perhaps, but there is no SYNC
    else
      bus_->set_armed(member.node, false);
    note(std::move(error));
  }

  [[nodiscard]] can::SendOptions for_all() const {
    can::SendOptions options{.transaction_class = TransactionClass::motion, .more_guards = {together()}};
    for (const auto& member : members_)
      options.more_guards.insert(options.more_guards.end(), member.guards.begin(), member.guards.end());
    return options;
  }

  Task<> confirm(std::size_t index) {
    const auto& member = members_[index];
    const auto confirmed = co_await member.confirm();
    if (confirmed) {
      // A stop that came since has something wait there again.
      if (!disturbed() && !bus_->waits(member.node))
        bus_->set_readiness(member.node, CanopenBus::Readiness::settled);
      co_return;
    }
    auto error = confirmed.error();
    error.outcome = Outcome::unknown;
    note(std::move(error));
  }

  /// Before anything else: another master's SYNC could come at any time. The drive settles the node then.
  Task<> neutralise(std::size_t index) {
    const auto& member = members_[index];
    if (!bus_->armed(member.node)) co_return;
    bus_->set_readiness(member.node, CanopenBus::Readiness::unknown);
    (void)co_await bus_->send_waiting(member.node, member.cob_id, member.neutral(),
                                      {.transaction_class = TransactionClass::stop});
  }

  [[nodiscard]] MotionGuard together() const { return {.gate = together_, .epoch = epoch_}; }

  CanopenBus* bus_;
  std::vector<SyncStart> members_;
  TimePoint not_before_;
  std::shared_ptr<AxisGate> together_ = std::make_shared<AxisGate>();
  std::uint64_t epoch_ = together_->epoch();
  Surroundings before_;
  std::uint64_t foreign_syncs_ = 0;
  std::optional<Error> error_;
};

}  // namespace

Task<> for_each_at_once(Executor executor, Clock& clock, std::size_t count,
                        std::function<Task<>(std::size_t)> function) {
  struct Gathering {
    std::size_t missing;
    Signal ended;
  };
  Gathering gathering{.missing = count, .ended = Signal(executor, clock)};
  const auto one = [](Task<> task, Gathering& all) -> Task<> {
    co_await std::move(task);
    if (--all.missing == 0) all.ended.notify_all();
  };
  for (std::size_t i = 0; i < count; ++i) spawn(executor, one(function(i), gathering), "together");
  while (gathering.missing > 0) co_await gathering.ended.wait();
}

Task<Result<TimePoint>> common_start(CanopenBus& bus, std::vector<SyncStart> members, TimePoint not_before) {
  CommonStart start(bus, std::move(members), not_before);
  co_return co_await start.run();
}

}  // namespace axisd::canopen
