// The drives, buses and events of the fake machine: they record what is asked and answer what the test says.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "devices/machine.hpp"

namespace axisd::testing {

/// What the three have in common. Thread: any.
class FakeAccess {
 public:
  using Post = std::function<void(std::function<void()>)>;
  /// `post` runs a job on the machine's core thread.
  explicit FakeAccess(Post post) : post_(std::move(post)) {}

  /// All further calls are answered with this error; nullopt: as usual.
  void refuse_with(std::optional<Error> error);
  /// "read_parameters feeder 0x10 0x11", ...
  [[nodiscard]] std::vector<std::string> log() const;
  /// Work that somebody still holds the token of.
  [[nodiscard]] bool working() const;

 protected:
  void note(std::string line);
  template <class T>
  void answer(const std::function<void(Result<T>)>& callback, Result<T> result) {
    if (const auto error = refusal()) result = fail(*error);
    post_([callback, result = std::move(result)] { callback(result); });
  }
  [[nodiscard]] std::optional<Error> refusal() const;
  /// The token of new work; `remember` stores its callback before working() is true.
  std::shared_ptr<void> begin_work(const std::function<void()>& remember);

  mutable std::mutex mutex_;
  const Post post_;

 private:
  std::optional<Error> refusal_;
  std::vector<std::string> log_;
  std::weak_ptr<void> work_;
};

class FakeDrives final : public FakeAccess, public DriveAccess {
 public:
  using FakeAccess::FakeAccess;

  /// Of a change that was begun.
  void progress(Result<SerialProgress> progress);

  void drive_info(std::string axis, std::function<void(Result<DriveInfo>)> callback) override;
  void read_parameters(std::string axis, std::vector<std::uint32_t> addresses,
                       ValuesCallback callback) override;
  void write_parameters(std::string axis, std::vector<ParameterValue> values, Requester requester,
                        ValuesCallback callback) override;
  void save_parameters(std::string axis, Requester requester,
                       std::function<void(Result<void>)> callback) override;
  void restore_factory(std::string axis, Requester requester,
                       std::function<void(Result<std::string>)> callback) override;
  void read_segments(std::string axis, SegmentsCallback callback) override;
  void write_segments(std::string axis, SegmentSettings segments, Requester requester,
                      SegmentsCallback callback) override;
  std::shared_ptr<void> change_serial(std::string axis, SerialChange change, Requester requester,
                                      std::function<void(Result<SerialProgress>)> callback) override;

 private:
  std::function<void(Result<SerialProgress>)> progress_;
  SegmentSettings segments_{.absolute = true, .positions = {{.number = 2, .target = -5, .velocity = 10}}};
};

class FakeBuses final : public FakeAccess, public BusAccess {
 public:
  using FakeAccess::FakeAccess;

  /// Of a scan that was begun.
  void progress(Result<ScanProgress> progress);

  void transact(TransactRequest request,
                std::function<void(Result<std::vector<std::uint16_t>>)> callback) override;
  void transact_object(ObjectRequest request,
                       std::function<void(Result<std::vector<std::uint8_t>>)> callback) override;
  std::shared_ptr<void> scan(ScanRequest request,
                             std::function<void(Result<ScanProgress>)> callback) override;
  [[nodiscard]] std::vector<DeviceSnapshotPtr> devices() const override;
  void write_device(std::string device, std::string name, double value,
                    std::function<void(Result<double>)> callback) override;

 private:
  std::function<void(Result<ScanProgress>)> progress_;
};

class FakeWatch final : public FakeAccess, public BusWatch {
 public:
  using FakeAccess::FakeAccess;

  /// Of a trace that was begun.
  void frames(Result<TraceBatch> batch);
  /// Of a stream of statistics that was begun.
  void tick(Result<StatisticsTick> tick);
  /// The reader of the stream that was begun last can take the next message.
  [[nodiscard]] bool wanted() const;

  void statistics(std::string bus, std::function<void(Result<std::vector<BusStatistics>>)> callback) override;
  std::shared_ptr<StreamToken> watch_statistics(
      std::string bus, Duration period, std::function<void(Result<StatisticsTick>)> callback) override;
  std::shared_ptr<StreamToken> trace(TraceRequest request,
                                     std::function<void(Result<TraceBatch>)> callback) override;
  void flight_records(std::function<void(Result<std::vector<FlightRecord>>)> callback) override;
  void flight_record(std::string name, std::function<void(Result<std::string>)> callback) override;
  void write_flight_record(std::string bus, std::string client,
                           std::function<void(Result<std::string>)> callback) override;

 private:
  template <class T>
  std::shared_ptr<StreamToken> begin(std::function<void(Result<T>)> callback,
                                     std::function<void(Result<T>)>& kept);
  template <class T>
  void give(const std::function<void(Result<T>)>& to, Result<T> what);

  std::function<void(Result<TraceBatch>)> traced_;
  std::function<void(Result<StatisticsTick>)> watched_;
  std::weak_ptr<StreamToken> token_;
};

/// Gives every lease, with the token 7.
class FakeLeases final : public FakeAccess, public LeaseAccess {
 public:
  using FakeAccess::FakeAccess;

  void acquire(LeaseRequest request, std::function<void(Result<LeaseGrant>)> callback) override;
  void renew(Requester holder, std::function<void(Result<Lease>)> callback) override;
  void release(Requester holder, std::function<void(Result<void>)> callback) override;
  void list(std::function<void(std::vector<Lease>)> callback) override;

  /// That of the last request; half of its time is over at the machine's first moment.
  [[nodiscard]] Lease lease() const;

 private:
  Lease lease_{.token = 7};
};

/// Whose holds are to end, for a log.
std::string text_of(const HoldRelease& release);

/// Has the group "gantry" of the axes feeder and table; every move is done at once, as "g-1".
class FakeGroups final : public FakeAccess, public GroupAccess {
 public:
  using FakeAccess::FakeAccess;

  [[nodiscard]] std::vector<GroupSettings> groups() const override { return groups_; }
  void move(GroupMoveRequest request, CommandOptions options, WaitUntil until,
            std::function<void(Result<GroupMove>)> callback) override;
  void start(GroupStartRequest request, WaitUntil until,
             std::function<void(Result<GroupMove>)> callback) override;
  void renew(std::string id, std::string client, GroupRenewal renewal,
             std::function<void(Result<GroupMove>)> callback) override;
  void get(std::string id, std::function<void(Result<GroupMove>)> callback) override;
  void stop(GroupStopRequest request, std::string client, WaitUntil until,
            std::function<void(std::vector<GroupStopResult>)> callback) override;
  void release_stop(GroupReleaseRequest request,
                    std::function<void(std::vector<GroupReleaseResult>)> callback) override;

 private:
  std::vector<GroupSettings> groups_{
      {.name = "gantry", .axes = {"feeder", "table"}, .max_arrival_error = std::chrono::milliseconds(20)}};
};

class FakeEvents final : public EventSource {
 public:
  /// Keeps at most `kept` events.
  explicit FakeEvents(FakeAccess::Post post, std::size_t kept = 1000) : post_(std::move(post)), kept_(kept) {}

  void add(std::string axis, EventContent content);
  void keep(std::size_t kept);

  [[nodiscard]] Batch events_after(std::uint64_t cursor, std::size_t most) const override;
  void on_event(std::function<void()> notify) override;

 private:
  mutable std::mutex mutex_;
  const FakeAccess::Post post_;
  std::size_t kept_;
  std::uint64_t newest_ = 0;
  std::vector<Event> events_;
  std::function<void()> notify_ = [] {};
};

}  // namespace axisd::testing
