#include "tests/conformance/counted_machine.hpp"

#include <string>
#include <string_view>

namespace axisd::conformance {

namespace {

using Token = std::shared_ptr<void>;

/// Starts something whose token the caller wants at once, although it begins on the core thread.
template <class Start>
Token deferred(CallLedger& ledger, Start start) {
  auto token = std::make_shared<Token>();
  ledger.enter([start = std::move(start), weak = std::weak_ptr(token)](const CallLedger::TicketPtr& ticket) {
    if (const auto held = weak.lock()) *held = start(ticket);
  });
  return token;
}

class CountedDrives final : public DriveAccess {
 public:
  CountedDrives(DriveAccess& inner, CallLedger& ledger) : inner_(&inner), ledger_(&ledger) {}

  void drive_info(std::string axis, std::function<void(Result<DriveInfo>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->drive_info(axis, ledger_->answer(ticket, callback)); });
  }
  void read_parameters(std::string axis, std::vector<std::uint32_t> addresses,
                       ValuesCallback callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->read_parameters(axis, addresses, ledger_->answer(ticket, callback));
    });
  }
  void write_parameters(std::string axis, std::vector<ParameterValue> values, Requester requester,
                        ValuesCallback callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->write_parameters(axis, values, requester, ledger_->answer(ticket, callback));
    });
  }
  void save_parameters(std::string axis, Requester requester,
                       std::function<void(Result<void>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->save_parameters(axis, requester, ledger_->answer(ticket, callback));
    });
  }
  void restore_factory(std::string axis, Requester requester,
                       std::function<void(Result<std::string>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->restore_factory(axis, requester, ledger_->answer(ticket, callback));
    });
  }
  void read_segments(std::string axis, SegmentsCallback callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->read_segments(axis, ledger_->answer(ticket, callback)); });
  }
  void write_segments(std::string axis, SegmentSettings segments, Requester requester,
                      SegmentsCallback callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->write_segments(axis, segments, requester, ledger_->answer(ticket, callback));
    });
  }
  /// Counts until the first phase is reported: what follows waits for somebody to switch the drive off and
  /// on.
  Token change_serial(std::string axis, SerialChange change, Requester requester,
                      std::function<void(Result<SerialProgress>)> callback) override {
    return deferred(*ledger_, [=, this](const auto& ticket) {
      return inner_->change_serial(axis, change, requester, ledger_->answer(ticket, callback));
    });
  }

 private:
  DriveAccess* inner_;
  CallLedger* ledger_;
};

class CountedBuses final : public BusAccess {
 public:
  CountedBuses(BusAccess& inner, CallLedger& ledger) : inner_(&inner), ledger_(&ledger) {}

  void transact(TransactRequest request,
                std::function<void(Result<std::vector<std::uint16_t>>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->transact(request, ledger_->answer(ticket, callback)); });
  }
  void transact_object(ObjectRequest request,
                       std::function<void(Result<std::vector<std::uint8_t>>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->transact_object(request, ledger_->answer(ticket, callback));
    });
  }
  /// Counts until it is finished, or nobody listens any more.
  Token scan(ScanRequest request, std::function<void(Result<ScanProgress>)> callback) override {
    return deferred(*ledger_, [=, this](const CallLedger::TicketPtr& ticket) {
      return inner_->scan(request, [=](const Result<ScanProgress>& progress) {
        callback(progress);
        if (!progress || progress->finished) ticket->release();
      });
    });
  }
  [[nodiscard]] std::vector<DeviceSnapshotPtr> devices() const override { return inner_->devices(); }
  void write_device(std::string device, std::string name, double value,
                    std::function<void(Result<double>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->write_device(device, name, value, ledger_->answer(ticket, callback));
    });
  }

 private:
  BusAccess* inner_;
  CallLedger* ledger_;
};

class CountedWatch final : public BusWatch {
 public:
  CountedWatch(BusWatch& inner, CallLedger& ledger) : inner_(&inner), ledger_(&ledger) {}

  void statistics(std::string bus,
                  std::function<void(Result<std::vector<BusStatistics>>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->statistics(bus, ledger_->answer(ticket, callback)); });
  }
  /// Never counts, as trace(): it has no end of its own.
  std::shared_ptr<StreamToken> watch_statistics(
      std::string bus, Duration period, std::function<void(Result<StatisticsTick>)> callback) override {
    return inner_->watch_statistics(std::move(bus), period, std::move(callback));
  }
  std::shared_ptr<StreamToken> trace(TraceRequest request,
                                     std::function<void(Result<TraceBatch>)> callback) override {
    return inner_->trace(std::move(request), std::move(callback));
  }
  void flight_records(std::function<void(Result<std::vector<FlightRecord>>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->flight_records(ledger_->answer(ticket, callback)); });
  }
  void flight_record(std::string name, std::function<void(Result<std::string>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->flight_record(name, ledger_->answer(ticket, callback)); });
  }
  void write_flight_record(std::string bus, std::string client,
                           std::function<void(Result<std::string>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->write_flight_record(bus, client, ledger_->answer(ticket, callback));
    });
  }

 private:
  BusWatch* inner_;
  CallLedger* ledger_;
};

class CountedLeases final : public LeaseAccess {
 public:
  CountedLeases(LeaseAccess& inner, CallLedger& ledger) : inner_(&inner), ledger_(&ledger) {}

  void acquire(LeaseRequest request, std::function<void(Result<LeaseGrant>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->acquire(request, ledger_->answer(ticket, callback)); });
  }
  void renew(Requester holder, std::function<void(Result<Lease>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->renew(holder, ledger_->answer(ticket, callback)); });
  }
  void release(Requester holder, std::function<void(Result<void>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->release(holder, ledger_->answer(ticket, callback)); });
  }
  void list(std::function<void(std::vector<Lease>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) { inner_->list(ledger_->answer(ticket, callback)); });
  }

 private:
  LeaseAccess* inner_;
  CallLedger* ledger_;
};

class CountedGroups final : public GroupAccess {
 public:
  CountedGroups(GroupAccess& inner, CallLedger& ledger) : inner_(&inner), ledger_(&ledger) {}

  [[nodiscard]] std::vector<GroupSettings> groups() const override { return inner_->groups(); }
  void move(GroupMoveRequest request, CommandOptions options, WaitUntil until,
            std::function<void(Result<GroupMove>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->move(request, options, until, ledger_->answer(ticket, callback));
    });
  }
  void start(GroupStartRequest request, WaitUntil until,
             std::function<void(Result<GroupMove>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->start(request, until, ledger_->answer(ticket, callback)); });
  }
  void renew(std::string id, std::string client, GroupRenewal renewal,
             std::function<void(Result<GroupMove>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->renew(id, client, renewal, ledger_->answer(ticket, callback));
    });
  }
  void get(std::string id, std::function<void(Result<GroupMove>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) { inner_->get(id, ledger_->answer(ticket, callback)); });
  }
  void stop(GroupStopRequest request, std::string client, WaitUntil until,
            std::function<void(std::vector<GroupStopResult>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->stop(request, client, until, ledger_->answer(ticket, callback));
    });
  }
  void release_stop(GroupReleaseRequest request,
                    std::function<void(std::vector<GroupReleaseResult>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->release_stop(request, ledger_->answer(ticket, callback)); });
  }

 private:
  GroupAccess* inner_;
  CallLedger* ledger_;
};

class CountedMachine final : public Machine {
 public:
  CountedMachine(Machine& inner, CallLedger& ledger)
      : inner_(&inner),
        ledger_(&ledger),
        drives_(inner.drive_access(), ledger),
        buses_(inner.bus_access(), ledger),
        watch_(inner.bus_watch(), ledger),
        leases_(inner.lease_access(), ledger),
        groups_(inner.group_access(), ledger) {}

  [[nodiscard]] std::vector<std::string> axis_names() const override { return inner_->axis_names(); }
  [[nodiscard]] AxisSnapshotPtr snapshot(std::string_view axis) const override {
    return inner_->snapshot(axis);
  }
  [[nodiscard]] MachineInfo info() const override { return inner_->info(); }

  void submit(std::string axis, Action action, CommandOptions options, WaitUntil until,
              CommandCallback callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->submit(axis, action, options, until, ledger_->answer(ticket, callback));
    });
  }
  void explain(std::string axis, std::optional<Action> action, CommandOptions options,
               std::function<void(Result<std::vector<Obstacle>>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->explain(axis, action, options, ledger_->answer(ticket, callback));
    });
  }
  void release_stop(std::string axis, HoldRelease release,
                    std::function<void(Result<StopReleased>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->release_stop(axis, release, ledger_->answer(ticket, callback));
    });
  }
  void stop_all(Requester requester, WaitUntil until, std::function<void(AllStopped)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->stop_all(requester, until, ledger_->answer(ticket, callback));
    });
  }
  void kept_state(std::function<void(KeptStateReport)> callback) override {
    ledger_->enter([=, this](const auto& ticket) { inner_->kept_state(ledger_->answer(ticket, callback)); });
  }
  void accept_state(std::string client,
                    std::function<void(Result<std::vector<Conviction>>)> callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->accept_state(client, ledger_->answer(ticket, callback)); });
  }
  void release_inhibit(std::string client, std::function<void(Result<void>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->release_inhibit(client, ledger_->answer(ticket, callback));
    });
  }
  void list_commands(std::string axis, std::size_t most,
                     std::function<void(std::vector<Command>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->list_commands(axis, most, ledger_->answer(ticket, callback));
    });
  }
  void get_command(std::string id, CommandCallback callback) override {
    ledger_->enter(
        [=, this](const auto& ticket) { inner_->get_command(id, ledger_->answer(ticket, callback)); });
  }
  Token watch_command(std::string id, CommandCallback callback) override {
    return inner_->watch_command(std::move(id), std::move(callback));
  }
  void cancel_command(std::string id, std::string client, CommandCallback callback) override {
    ledger_->enter([=, this](const auto& ticket) {
      inner_->cancel_command(id, client, ledger_->answer(ticket, callback));
    });
  }
  [[nodiscard]] std::size_t stops_waiting(const std::string& identity) const override {
    return inner_->stops_waiting(identity);
  }
  void buses(std::function<void(std::vector<BusStatus>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) { inner_->buses(ledger_->answer(ticket, callback)); });
  }
  void budgets(std::function<void(std::vector<BusBudgetReport>)> callback) override {
    ledger_->enter([=, this](const auto& ticket) { inner_->budgets(ledger_->answer(ticket, callback)); });
  }

  [[nodiscard]] DriveAccess& drive_access() override { return drives_; }
  [[nodiscard]] BusAccess& bus_access() override { return buses_; }
  [[nodiscard]] BusWatch& bus_watch() override { return watch_; }
  [[nodiscard]] LeaseAccess& lease_access() override { return leases_; }
  [[nodiscard]] GroupAccess& group_access() override { return groups_; }
  [[nodiscard]] EventSource& events() override { return inner_->events(); }
  void on_published(std::function<void()> notify) override { inner_->on_published(std::move(notify)); }
  [[nodiscard]] WallTime wall(TimePoint t) const override { return inner_->wall(t); }
  [[nodiscard]] TimePoint now() const override { return inner_->now(); }

 private:
  Machine* inner_;
  CallLedger* ledger_;
  CountedDrives drives_;
  CountedBuses buses_;
  CountedWatch watch_;
  CountedLeases leases_;
  CountedGroups groups_;
};

}  // namespace

std::unique_ptr<Machine> count_calls(Machine& inner, CallLedger& ledger) {
  return std::make_unique<CountedMachine>(inner, ledger);
}

}  // namespace axisd::conformance
