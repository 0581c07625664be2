#include "api/axisctl/cell_events.hpp"

#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/time_util.h>

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "api/axisctl/across.hpp"
#include "api/axisctl/cell_view.hpp"
#include "api/axisctl/event_text.hpp"
#include "api/axisctl/follow.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/machine_streams.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/cell/v1/cell_service.grpc.pb.h"
#include "axisd/v1/event_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using google::protobuf::util::TimeUtil;

struct Line {
  google::protobuf::Timestamp at;
  std::string text;
};

/// Where a reader is.
struct Position {
  std::string instance_id;
  std::uint64_t cursor = 0;
};

/// An event of a machine says so, also where it is of none of its axes.
Line line_of(const std::string& machine, v1::Event event, bool as_json) {
  if (!as_json) {
    if (event.axis().empty()) event.set_axis(machine);
    return {event.at(), event_line(event)};
  }
  google::protobuf::Struct fields;
  if (!google::protobuf::util::JsonStringToMessage(json(event), &fields).ok())
    return {event.at(), json(event)};
  (*fields.mutable_fields())["machine"].set_string_value(machine);
  return {event.at(), json(fields)};
}

class Reader {
 public:
  Reader(Invocation& invocation, const CellEventQuery& query)
      : invocation_(invocation), query_(query), selection_(query.words) {}

  void run() {
    const bool only_new = !query_.machines.has_after_sequence();
    if (!only_new || !query_.follow) read_kept();
    for (const auto& [at, text] : kept_) print_line(text);
    if (query_.follow) follow_all();
  }

 private:
  /// What is kept everywhere, up to the newest.
  void read_kept() {
    if (query_.of_cell)
      follow<cell::v1::WatchEventsResponse>(invocation_.client(), &cell::v1::CellService::Stub::WatchEvents,
                                            cell_request(), "",
                                            [this](const cell::v1::WatchEventsResponse& batch) {
                                              take_of_cell(batch, true);
                                              return batch.cursor() < batch.newest();
                                            });
    if (!query_.of_machines) return;
    const auto known = machines_of_cell(invocation_);
    const auto names = selected(known, selection_);
    if (!query_.follow) tell_left_out(known, selection_);  // else it is told where they are followed
    std::vector<std::string> slashed;
    slashed.reserve(names.size());
    for (const auto& name : names) slashed.push_back(name + "/");
    std::vector<std::optional<Failure>> failures(names.size());
    for_each_machine(slashed, [&](const std::vector<std::size_t>& indices) {
      for (const auto i : indices) failures[i] = read_kept_of(names[i]);
    });
    for (const auto& failure : failures) {
      if (!failure) continue;
      complain(*failure, invocation_.json);
      invocation_.status = failure->code();
    }
  }

  std::optional<Failure> read_kept_of(const std::string& name) {
    const auto client = invocation_.client().at(name);
    grpc::ClientContext context;
    bool all = false;
    auto stream = client.stream(context, &v1::EventService::Stub::WatchEvents, request_for(name));
    for (v1::WatchEventsResponse batch; !all && stream.read(batch);) {
      take(name, batch, true);
      all = batch.cursor() >= batch.newest();
    }
    if (all) context.TryCancel();
    const auto status = stream.finish();
    return all ? std::nullopt : std::optional(ended(client, status, name));
  }

  void follow_all() {
    {
      const std::lock_guard lock(mutex_);
      following_ = true;
    }
    if (!query_.of_machines)
      return follow<cell::v1::WatchEventsResponse>(invocation_.client(),
                                                   &cell::v1::CellService::Stub::WatchEvents, cell_request(),
                                                   "", [this](const cell::v1::WatchEventsResponse& batch) {
                                                     take_of_cell(batch, false);
                                                     return true;
                                                   });
    grpc::ClientContext context;
    const std::jthread cell(query_.of_cell ? std::jthread([&] { follow_cell(context); }) : std::jthread());
    const std::shared_ptr<void> cancelling(nullptr, [&context](void*) { context.TryCancel(); });
    follow_machines();
  }

  void follow_machines() {
    MachineStreams* opened = nullptr;
    MachineStreams streams(
        invocation_, selection_,
        [&](const Client& machine, grpc::ClientContext& context, const std::string& name) {
          auto stream = machine.stream(context, &v1::EventService::Stub::WatchEvents, request_for(name));
          for (v1::WatchEventsResponse batch; stream.read(batch);) {
            opened->flows(name);
            take(name, batch, false);
          }
          return ended(machine, stream.finish(), name);
        },
        [this](const std::string&, const std::optional<Failure>& trouble) {
          const std::lock_guard lock(mutex_);
          if (trouble) complain(*trouble, invocation_.json);
        });
    opened = &streams;
    streams.run();
  }

  /// An entrance that is lost ends the list of machines as well, and with it the program.
  void follow_cell(grpc::ClientContext& context) {
    auto stream =
        invocation_.client().stream(context, &cell::v1::CellService::Stub::WatchEvents, cell_request());
    for (cell::v1::WatchEventsResponse batch; stream.read(batch);) take_of_cell(batch, false);
    stream.finish();
  }

  static Failure ended(const Client& machine, const grpc::Status& status, const std::string& name) {
    return status.ok() ? Failure(ExitCode::unreachable, fmt::format("{}: the daemon ended the stream", name))
                       : machine.failure(status, name);
  }

  cell::v1::WatchEventsRequest cell_request() {
    const std::lock_guard lock(mutex_);
    cell::v1::WatchEventsRequest request;
    request.set_instance_id(cell_position_.instance_id);
    if (query_.machines.has_after_sequence() || !cell_position_.instance_id.empty())
      request.set_after_sequence(cell_position_.cursor);
    return request;
  }

  v1::WatchEventsRequest request_for(const std::string& name) {
    const std::lock_guard lock(mutex_);
    auto request = query_.machines;
    for (const auto& axis : selection_.axes_of(name)) request.add_axes(axis);
    const auto seen = positions_.find(name);
    if (seen != positions_.end()) {
      request.set_instance_id(seen->second.instance_id);
      request.set_after_sequence(seen->second.cursor);
    } else if (following_) {
      request.clear_after_sequence();  // a machine that comes: what it keeps is history
    }
    return request;
  }

  void take(const std::string& name, const v1::WatchEventsResponse& batch, bool kept) {
    const std::lock_guard lock(mutex_);
    positions_[name] = {batch.instance_id(), batch.cursor()};
    if (batch.lost() > 0 && !invocation_.json)
      print_line(fmt::format("({}: {} earlier events are no longer kept)", name, batch.lost()));
    for (const auto& event : batch.events())
      if (event.at() >= query_.from) add(line_of(name, event, invocation_.json), kept);
  }

  void take_of_cell(const cell::v1::WatchEventsResponse& batch, bool kept) {
    const std::lock_guard lock(mutex_);
    cell_position_ = {batch.instance_id(), batch.cursor()};
    if (batch.lost() > 0 && !invocation_.json)
      print_line(fmt::format("(cell: {} earlier events are no longer kept)", batch.lost()));
    for (const auto& event : batch.events())
      if (event.at() >= query_.from)
        add({event.at(), invocation_.json ? json(event) : cell_event_line(event)}, kept);
  }

  void add(Line line, bool kept) {
    if (kept)
      kept_.emplace(TimeUtil::TimestampToNanoseconds(line.at), std::move(line.text));
    else
      print_line(line.text);
  }

  Invocation& invocation_;
  const CellEventQuery& query_;
  const Selection selection_;
  std::mutex mutex_;
  std::multimap<std::int64_t, std::string> kept_;  ///< by their times
  std::map<std::string, Position> positions_;
  Position cell_position_;
  bool following_ = false;
};

}  // namespace

void cell_events(Invocation& invocation, const CellEventQuery& query) { Reader(invocation, query).run(); }

}  // namespace axisd::axisctl
