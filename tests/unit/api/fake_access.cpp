#include "tests/unit/api/fake_access.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <boost/smart_ptr/make_shared.hpp>
#include <chrono>
#include <utility>

namespace axisd::testing {

using namespace std::chrono_literals;

namespace {

/// "unix:anna", "unix:anna under 7".
std::string text_of(const Requester& requester) {
  return requester.lease_token == 0 ? requester.client
                                    : fmt::format("{} under {}", requester.client, requester.lease_token);
}

}  // namespace

void FakeAccess::refuse_with(std::optional<Error> error) {
  const std::lock_guard lock(mutex_);
  refusal_ = std::move(error);
}

std::optional<Error> FakeAccess::refusal() const {
  const std::lock_guard lock(mutex_);
  return refusal_;
}

std::vector<std::string> FakeAccess::log() const {
  const std::lock_guard lock(mutex_);
  return log_;
}

bool FakeAccess::working() const {
  const std::lock_guard lock(mutex_);
  return !work_.expired();
}

void FakeAccess::note(std::string line) {
  const std::lock_guard lock(mutex_);
  log_.push_back(std::move(line));
}

std::shared_ptr<void> FakeAccess::begin_work(const std::function<void()>& remember) {
  const auto token = std::make_shared<int>(0);
  const std::lock_guard lock(mutex_);
  remember();
  work_ = token;
  return token;
}

void FakeDrives::drive_info(std::string axis, std::function<void(Result<DriveInfo>)> callback) {
  note("drive_info " + axis);
  answer<DriveInfo>(callback, DriveInfo{.descriptor = find_drive_model("ykd2405pr"),
                                        .identity = DriveIdentity{.model_code = 0x301, .version = "V1.0"},
                                        .eeprom_writes = 3,
                                        .persist = true,
                                        .configured_by = {{0x0011, "scale.microstep"}}});
}

void FakeDrives::read_parameters(std::string axis, std::vector<std::uint32_t> addresses,
                                 ValuesCallback callback) {
  note(fmt::format("read_parameters {} {:#x}", axis, fmt::join(addresses, " ")));
  std::vector<ParameterValue> values;
  values.reserve(addresses.size());
  for (const auto address : addresses) values.push_back({.address = address, .value = -1 - int(address)});
  answer<std::vector<ParameterValue>>(callback, std::move(values));
}

void FakeDrives::write_parameters(std::string axis, std::vector<ParameterValue> values, Requester requester,
                                  ValuesCallback callback) {
  std::string line = fmt::format("write_parameters {} by {}", axis, text_of(requester));
  for (const auto& value : values) line += fmt::format(" {:#x}={}", value.address, value.value);
  note(std::move(line));
  answer<std::vector<ParameterValue>>(callback, std::move(values));
}

void FakeDrives::save_parameters(std::string axis, Requester requester,
                                 std::function<void(Result<void>)> callback) {
  note(fmt::format("save_parameters {} by {}", axis, text_of(requester)));
  answer<void>(callback, {});
}

void FakeDrives::restore_factory(std::string axis, Requester requester,
                                 std::function<void(Result<std::string>)> callback) {
  note(fmt::format("restore_factory {} by {}", axis, text_of(requester)));
  answer<std::string>(callback, std::string("node by its switches, 9600 8N1"));
}

void FakeDrives::read_segments(std::string axis, SegmentsCallback callback) {
  note("read_segments " + axis);
  answer<SegmentSettings>(callback, segments_);
}

void FakeDrives::write_segments(std::string axis, SegmentSettings segments, Requester requester,
                                SegmentsCallback callback) {
  std::string line = fmt::format("write_segments {} by {}{}", axis, text_of(requester),
                                 segments.absolute ? " absolute" : "");
  for (const auto& row : segments.positions)
    line += fmt::format(" {}:{}:{}:{}", row.number, row.target, row.velocity, row.acceleration_time / 1ms);
  for (const auto& row : segments.velocities)
    line += fmt::format(" {}:{}:{}", row.number, row.velocity, row.acceleration_time / 1ms);
  note(std::move(line));
  answer<SegmentSettings>(callback, std::move(segments));
}

std::shared_ptr<void> FakeDrives::change_serial(std::string axis, SerialChange change, Requester requester,
                                                std::function<void(Result<SerialProgress>)> callback) {
  note(fmt::format("change_serial {} by {} node {} baud {} verify {}", axis, text_of(requester),
                   change.node.value_or(0), change.baud.value_or(0), change.verify / 1s));
  return begin_work([&] { progress_ = std::move(callback); });
}

void FakeDrives::progress(Result<SerialProgress> progress) {
  const std::lock_guard lock(mutex_);
  post_([callback = progress_, progress = std::move(progress)] { callback(progress); });
}

void FakeBuses::progress(Result<ScanProgress> progress) {
  const std::lock_guard lock(mutex_);
  post_([callback = progress_, progress = std::move(progress)] { callback(progress); });
}

void FakeBuses::transact(TransactRequest request,
                         std::function<void(Result<std::vector<std::uint16_t>>)> callback) {
  note(fmt::format("transact {} {} {:#x} count {} writes {}", request.bus, request.node, request.address,
                   request.count, fmt::join(request.values, ",")));
  std::vector<std::uint16_t> words;
  if (request.values.empty()) words.assign(request.count, 7);
  answer<std::vector<std::uint16_t>>(callback, std::move(words));
}

void FakeBuses::transact_object(ObjectRequest request,
                                std::function<void(Result<std::vector<std::uint8_t>>)> callback) {
  note(fmt::format("transact_object {} {} {:#x} writes {:#x}", request.bus, request.node, request.object,
                   fmt::join(request.bytes, ",")));
  answer<std::vector<std::uint8_t>>(
      callback, request.bytes.empty() ? std::vector<std::uint8_t>{0xFE, 0xFF} : std::vector<std::uint8_t>());
}

std::shared_ptr<void> FakeBuses::scan(ScanRequest request,
                                      std::function<void(Result<ScanProgress>)> callback) {
  note(fmt::format("scan {} {}-{} bauds {} formats {}", request.bus, request.first_node, request.last_node,
                   fmt::join(request.bauds, ","), request.formats.size()));
  return begin_work([&] { progress_ = std::move(callback); });
}

std::vector<DeviceSnapshotPtr> FakeBuses::devices() const {
  return {boost::make_shared<const DeviceSnapshot>(
      DeviceSnapshot{.name = "valves",
                     .bus = "line-a",
                     .node = 40,
                     .link = LinkState::online,
                     .values = {{.name = "pressure", .unit = "bar", .value = 2.5, .writable = true},
                                {.name = "flow", .unit = "", .value = {}, .writable = false}},
                     .measured_at = WallTime(1s)})};
}

void FakeBuses::write_device(std::string device, std::string name, double value,
                             std::function<void(Result<double>)> callback) {
  note(fmt::format("write_device {} {} {}", device, name, value));
  answer<double>(callback, value + 0.01);
}

template <class T>
void FakeWatch::give(const std::function<void(Result<T>)>& to, Result<T> what) {
  const std::lock_guard lock(mutex_);
  if (const auto token = token_.lock()) token->wanted = false;
  post_([to, what = std::move(what)] { to(what); });
}

void FakeWatch::frames(Result<TraceBatch> batch) { give(traced_, std::move(batch)); }
void FakeWatch::tick(Result<StatisticsTick> tick) { give(watched_, std::move(tick)); }

template <class T>
std::shared_ptr<StreamToken> FakeWatch::begin(std::function<void(Result<T>)> callback,
                                              std::function<void(Result<T>)>& kept) {
  if (const auto error = refusal()) {
    post_([callback, error] { callback(fail(*error)); });
    return nullptr;
  }
  auto token = std::make_shared<StreamToken>();
  const std::lock_guard lock(mutex_);
  kept = std::move(callback);
  token_ = token;
  return token;
}

bool FakeWatch::wanted() const {
  const std::lock_guard lock(mutex_);
  const auto token = token_.lock();
  return token && token->wanted;
}

void FakeWatch::statistics(std::string bus,
                           std::function<void(Result<std::vector<BusStatistics>>)> callback) {
  note("statistics " + bus);
  using namespace std::chrono_literals;
  modbus_rtu::LineStatistics line({}, TimePoint{});
  line.queued(TransactionClass::motion, 3);
  modbus_rtu::Transaction transaction;
  transaction.transaction_class = TransactionClass::motion;
  transaction.exchange.request.node = 3;
  modbus_rtu::ExchangeResult result{.status = modbus_rtu::ExchangeStatus::replied,
                                    .reply = {.kind = modbus_rtu::ReplyKind::exception, .exception_code = 2},
                                    .request_begin = TimePoint(1s),
                                    .request_end = TimePoint(1001ms),
                                    .reply_begin = TimePoint(1003ms),
                                    .reply_end = TimePoint(1005ms)};
  transaction.queued_at = TimePoint(998ms);
  line.ended(transaction, result);
  result = {.status = modbus_rtu::ExchangeStatus::not_sent, .verdict = Verdict::superseded};
  line.ended(transaction, result);
  BusStatistics statistics{.bus = "line-a",
                           .since_start = 10s,
                           .recent_load = 0.25,
                           .overall_load = 0.125,
                           .line = std::move(line)};
  statistics.quarantine[3] = {.active = true, .lasting = 7s, .next_probe_in = 250ms, .probes = 4, .times = 2};
  statistics.held_back = 5;
  statistics.known[3] = {.name = "feeder",
                         .unknown_starts = {.executed = 1, .not_executed = 2, .unresolved = 3}};
  BusStatistics network{.bus = "can0", .kind = BusKind::canopen, .since_start = 10s};
  network.network[5] = {.sdo = {.transfers = 7, .aborted_by_node = 1, .timeouts = 2},
                        .traffic = {.tpdos = 40, .rpdos = 4, .heartbeats_lost = 1, .boots = 2},
                        .emergencies = 6};
  network.sdo.emplace().at(4).exchange.add(3ms);
  answer(callback, Result<std::vector<BusStatistics>>({std::move(statistics), std::move(network)}));
}

std::shared_ptr<StreamToken> FakeWatch::trace(TraceRequest request,
                                              std::function<void(Result<TraceBatch>)> callback) {
  note("trace " + request.bus + (request.node ? " " + std::to_string(*request.node) : ""));
  return begin(std::move(callback), traced_);
}

std::shared_ptr<StreamToken> FakeWatch::watch_statistics(
    std::string bus, Duration period, std::function<void(Result<StatisticsTick>)> callback) {
  note(fmt::format("watch_statistics {} {}", bus, period / 1ms));
  return begin(std::move(callback), watched_);
}

void FakeWatch::flight_records(std::function<void(Result<std::vector<FlightRecord>>)> callback) {
  note("flight_records");
  answer(callback, Result<std::vector<FlightRecord>>({{.name = "line-a-1.wire",
                                                       .bus = "line-a",
                                                       .reason = "feeder: ErrorStop",
                                                       .written_at = WallTime(std::chrono::hours(1)),
                                                       .size = 77}}));
}

void FakeWatch::flight_record(std::string name, std::function<void(Result<std::string>)> callback) {
  note("flight_record " + name);
  answer(callback, Result<std::string>("# bus: line-a\n"));
}

void FakeWatch::write_flight_record(std::string bus, std::string client,
                                    std::function<void(Result<std::string>)> callback) {
  note("write_flight_record " + bus + " " + client);
  answer(callback, Result<std::string>("line-a-2.wire"));
}

void FakeLeases::acquire(LeaseRequest request, std::function<void(Result<LeaseGrant>)> callback) {
  note(fmt::format("acquire {} by {} as '{}' ttl {} take {} id '{}'", fmt::join(request.axes, "+"),
                   request.client, request.label, request.ttl.value_or(0s) / 1ms, request.take,
                   request.request_id));
  LeaseGrant grant{.lease = {.token = 7,
                             .client = request.client,
                             .label = request.label,
                             .axes = request.axes,
                             .ttl = 2s,
                             .acquired = TimePoint(1h),
                             .expires = TimePoint(1h + 1s)}};
  {
    const std::lock_guard lock(mutex_);
    lease_ = grant.lease;
  }
  if (request.take)
    grant.taken = {{.lease = {.token = 6, .client = "other", .axes = {"feeder"}}, .end = LeaseEnd::taken},
                   {.lease = {.token = 5, .client = "late", .axes = {"feeder"}}, .end = LeaseEnd::expired}};
  answer<LeaseGrant>(callback, grant);
}

void FakeLeases::renew(Requester holder, std::function<void(Result<Lease>)> callback) {
  note("renew by " + text_of(holder));
  answer<Lease>(callback, lease());
}

void FakeLeases::release(Requester holder, std::function<void(Result<void>)> callback) {
  note("release by " + text_of(holder));
  answer<void>(callback, {});
}

void FakeLeases::list(std::function<void(std::vector<Lease>)> callback) {
  post_([callback, all = std::vector{lease()}] { callback(all); });
}

Lease FakeLeases::lease() const {
  const std::lock_guard lock(mutex_);
  return lease_;
}

void FakeGroups::move(GroupMoveRequest request, CommandOptions options, WaitUntil until,
                      std::function<void(Result<GroupMove>)> callback) {
  std::string targets;
  for (const auto& target : request.targets)
    targets +=
        fmt::format(" {}{}{}", target.axis,
                    target.position ? "=" : "+=", target.position.value_or(target.distance.value_or(0)));
  const bool when_told = request.start == GroupStart::when_told;
  note(fmt::format("{} {}{} together {} within {} by {} as {} until {}", when_told ? "prepare" : "move",
                   request.group, targets, request.arrive_together,
                   request.max_arrival_error.value_or(-1ms) / 1ms, options.client, options.request_id,
                   static_cast<int>(until)));
  std::optional<GroupPreparation> preparation;
  if (when_told)
    preparation = {
        .expires = TimePoint(9s), .notice = 80ms, .predicted_skew = 4ms, .first_start = TimePoint(8s)};
  answer<GroupMove>(callback, GroupMove{.id = "g-1",
                                        .group = request.group,
                                        .state = when_told ? CommandState::accepted : CommandState::done,
                                        .members = {{.command = {.id = "c-1", .axis = "feeder"},
                                                     .predicted = 1500ms,
                                                     .by_sync = true,
                                                     .note = "no",
                                                     .started_after = 0ms,
                                                     .arrived_after = 1503ms}},
                                        .arrive_together = request.arrive_together,
                                        .predicted_arrival_error = 1ms,
                                        .start_skew = 5ms,
                                        .arrival_error = 7ms,
                                        .preparation = preparation});
}

void FakeGroups::start(GroupStartRequest request, WaitUntil until,
                       std::function<void(Result<GroupMove>)> callback) {
  note(fmt::format("start {} at {} by {} until {}", request.id, request.at.time_since_epoch() / 1ms,
                   request.client, static_cast<int>(until)));
  answer<GroupMove>(callback, GroupMove{.id = request.id, .preparation = {{.starts_at = request.at}}});
}

void FakeGroups::renew(std::string id, std::string client, GroupRenewal renewal,
                       std::function<void(Result<GroupMove>)> callback) {
  note(fmt::format("renew {} by {}{}", id, client, renewal == GroupRenewal::all_told ? ", all told" : ""));
  const auto state = id == "g-done" ? CommandState::done : CommandState::active;
  answer<GroupMove>(
      callback,
      GroupMove{.id = id, .state = state, .members = {{.command = {.axis = "feeder"}}}, .preparation = {{}}});
}

void FakeGroups::get(std::string id, std::function<void(Result<GroupMove>)> callback) {
  note("get " + id);
  answer<GroupMove>(callback, GroupMove{.id = id});
}

void FakeGroups::stop(GroupStopRequest request, std::string client, WaitUntil until,
                      std::function<void(std::vector<GroupStopResult>)> callback) {
  note(fmt::format("stop {} {} kind {} hold {}{} by {} until {}", request.group, fmt::join(request.axes, "+"),
                   static_cast<int>(request.kind), request.hold,
                   request.request_id.empty() ? "" : " as " + request.request_id, client,
                   static_cast<int>(until)));
  std::vector<GroupStopResult> results;
  results.reserve(request.axes.size());
  for (const auto& axis : request.axes)
    results.push_back({.axis = axis,
                       .command = axis == "nobody"
                                      ? Result<Command>(fail(Reason::unknown_axis, "there is no axis"))
                                      : Result<Command>(Command{.id = "c-2", .axis = axis})});
  post_([callback, results] { callback(results); });
}

void FakeGroups::release_stop(GroupReleaseRequest request,
                              std::function<void(std::vector<GroupReleaseResult>)> callback) {
  note(
      fmt::format("release {} {} {}", request.group, fmt::join(request.axes, "+"), text_of(request.release)));
  std::vector<GroupReleaseResult> results;
  for (const auto& axis : request.axes) {
    if (axis == "nobody")
      results.push_back({.axis = axis, .holds = fail(Reason::unknown_axis, "there is no axis")});
    else
      results.push_back(
          {.axis = axis, .holds = std::vector<StopHold>{{.key = {.holder = "hmi", .request_id = "r-1"}}}});
  }
  post_([callback, results] { callback(results); });
}

std::string text_of(const HoldRelease& release) {
  return fmt::format("by {} as {} whose {} token {}", release.client, release.request_id,
                     static_cast<int>(release.whose), release.lease_token);
}

void FakeEvents::add(std::string axis, EventContent content) {
  std::function<void()> notify;
  {
    const std::lock_guard lock(mutex_);
    events_.push_back({.sequence = ++newest_,
                       .at = WallTime(std::chrono::seconds(newest_)),
                       .axis = std::move(axis),
                       .content = std::move(content)});
    if (events_.size() > kept_) events_.erase(events_.begin());
    notify = notify_;
  }
  post_(std::move(notify));
}

void FakeEvents::keep(std::size_t kept) {
  const std::lock_guard lock(mutex_);
  kept_ = kept;
}

EventSource::Batch FakeEvents::events_after(std::uint64_t cursor, std::size_t most) const {
  const std::lock_guard lock(mutex_);
  Batch batch{.newest = newest_};
  if (events_.empty()) return batch;
  const auto oldest = events_.front().sequence;
  if (cursor + 1 < oldest) batch.lost = oldest - cursor - 1;
  for (const auto& event : events_)
    if (event.sequence > cursor && batch.events.size() < most) batch.events.push_back(event);
  return batch;
}

void FakeEvents::on_event(std::function<void()> notify) {
  const std::lock_guard lock(mutex_);
  notify_ = std::move(notify);
}

}  // namespace axisd::testing
