// A client of the public API, as anybody could write it: generated stubs, one call at a time.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/command_service.grpc.pb.h"
#include "axisd/v1/drive_service.grpc.pb.h"
#include "axisd/v1/event_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"
#include "buses/clock.hpp"
#include "tests/conformance/target.hpp"

namespace axisd::conformance {

/// What a call came to.
template <class Response>
struct Answer {
  grpc::Status status;
  Response response;
  v1::ErrorDetail error{};  ///< of a call that failed

  [[nodiscard]] bool ok() const { return status.ok(); }
  const Response* operator->() const { return &response; }
};

/// "DONE", or state and cause, or the status of the call: for failure messages and comparisons.
std::string describe(const v1::Command& command);

/// Values of a motion; unset ones are left out of the request.
struct Motion {
  std::optional<double> velocity{};
  std::optional<Duration> acceleration_time{}, deceleration_time{}, hold{};
  bool buffered = false;
};

void to_proto(Duration from, google::protobuf::Duration& to);
double seconds_of(const google::protobuf::Duration& from);
Duration from_proto(const google::protobuf::Timestamp& from);

/// Of one axis. Every call has a deadline in real time that no call comes near.
class Client {
 public:
  Client(Target& target, std::string axis) : target_(&target), axis_(std::move(axis)) {}

  [[nodiscard]] const std::string& axis() const { return axis_; }
  v1::AxisState state();

  // Until it has ended, unless `wait` says otherwise. A refused call shows in the status.
  Answer<v1::Command> enable();
  Answer<v1::Command> disable();
  Answer<v1::Command> home(v1::WaitUntil wait = v1::WAIT_UNTIL_DONE);
  Answer<v1::Command> move_to(double position, Motion with = {}, v1::WaitUntil wait = v1::WAIT_UNTIL_DONE);
  Answer<v1::Command> move_by(double distance, Motion with = {}, v1::WaitUntil wait = v1::WAIT_UNTIL_DONE);
  Answer<v1::Command> velocity(double velocity, Motion with = {},
                               v1::WaitUntil wait = v1::WAIT_UNTIL_STARTED);
  Answer<v1::Command> jog(double velocity, Motion with = {}, v1::WaitUntil wait = v1::WAIT_UNTIL_ACCEPTED);
  Answer<v1::Command> halt(v1::WaitUntil wait = v1::WAIT_UNTIL_DONE);
  Answer<v1::Command> stop(bool hold = false, v1::WaitUntil wait = v1::WAIT_UNTIL_DONE);
  Answer<v1::Command> quick_stop(bool hold = false, v1::WaitUntil wait = v1::WAIT_UNTIL_DONE);
  Answer<v1::Command> release_stop();
  Answer<v1::Command> reset();
  Answer<v1::Command> set_position(double position);
  /// The command as it stands now.
  v1::Command look_up(const v1::Command& command);

  template <class Stub, class Request, class Response>
  Answer<Response> call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                        const Request& request) {
    grpc::ClientContext context;
    set_deadline(context);
    Stub stub(target_->channel());
    Answer<Response> answer;
    answer.status = (stub.*method)(&context, request, &answer.response);
    answer.error = detail_of(answer.status);
    return answer;
  }
  /// Events of the axis from the oldest that is kept, until one fulfils `last` or `patience` in real time is
  /// over.
  template <class Last>
  std::vector<v1::Event> events_until(Last last);

  static void set_deadline(grpc::ClientContext& context);
  static v1::ErrorDetail detail_of(const grpc::Status& status);
  [[nodiscard]] Target& target() { return *target_; }

 private:
  template <class Request>
  Request request(v1::WaitUntil wait);
  template <class Stub, class Request, class Response>
  Answer<v1::Command> command(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                              const Request& request);

  Target* target_;
  std::string axis_;
};

template <class Last>
std::vector<v1::Event> Client::events_until(Last last) {
  grpc::ClientContext context;
  set_deadline(context);
  v1::WatchEventsRequest request;
  request.set_instance_id("-");  // of no run: from the oldest event kept
  request.add_axes(axis_);
  v1::EventService::Stub stub(target_->channel());
  auto reader = stub.WatchEvents(&context, request);
  std::vector<v1::Event> events;
  v1::WatchEventsResponse batch;
  bool found = false;
  while (!found && reader->Read(&batch))
    for (const auto& event : batch.events()) {
      events.push_back(event);
      found = found || last(event);
    }
  context.TryCancel();
  while (reader->Read(&batch)) {
  }
  return events;
}

}  // namespace axisd::conformance
