#include "api/server/door_check.hpp"

#include <grpcpp/create_channel_posix.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <functional>
#include <utility>

#include "axisd/v1/stop_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::server {
namespace {

using ChannelPtr = std::shared_ptr<grpc::Channel>;
using Answered = std::function<void(const grpc::Status&)>;

/// Beyond this a question is given up and asked anew, so that one lost answer is not the last.
constexpr auto patience = std::chrono::seconds(10);

/// What lives until its answer is there.
template <class Service, class Request, class Response>
struct Question {
  explicit Question(const ChannelPtr& channel) : stub(Service::NewStub(channel)) {
    context.set_deadline(std::chrono::system_clock::now() + patience);
  }
  std::unique_ptr<typename Service::Stub> stub;
  grpc::ClientContext context;
  Request request;
  Response response;
};

void ask_main(const ChannelPtr& channel, Answered answered) {
  const auto question =
      std::make_shared<Question<v1::SystemService, v1::GetInfoRequest, v1::GetInfoResponse>>(channel);
  question->stub->async()->GetInfo(
      &question->context, &question->request, &question->response,
      [question, answered = std::move(answered)](const grpc::Status& status) { answered(status); });
}

void ask_lane(const ChannelPtr& channel, Answered answered) {
  const auto question =
      std::make_shared<Question<v1::StopService, v1::GroupStopRequest, v1::GroupStopResponse>>(channel);
  question->stub->async()->GroupStop(
      &question->context, &question->request, &question->response,
      [question, answered = std::move(answered)](const grpc::Status& status) { answered(status); });
}

/// Nobody was there, or not in time.
bool is_silence(const grpc::Status& status) {
  const auto code = status.error_code();
  return code == grpc::StatusCode::UNAVAILABLE || code == grpc::StatusCode::DEADLINE_EXCEEDED ||
         code == grpc::StatusCode::CANCELLED || code == grpc::StatusCode::UNKNOWN;
}

}  // namespace

class DoorCheck::Door : public std::enable_shared_from_this<Door> {
 public:
  using Ask = void (*)(const ChannelPtr& channel, Answered answered);

  Door(std::string name, Connect connect, Ask ask)
      : name_(std::move(name)), connect_(std::move(connect)), ask_(ask) {}

  void ask() {
    if (state_ == State::asked) return;
    if (owes_since_.load() == TimePoint::max()) owes_since_ = monotonic_now();
    if (state_ == State::unconnected) {
      auto socket = connect_();
      if (socket.get() < 0) return;  // out of descriptors: tried again with the next question
      channel_ = grpc::CreateInsecureChannelFromFd("axisd", socket.release());
    }
    state_ = State::asked;
    ask_(channel_, [self = shared_from_this()](const grpc::Status& status) {
      if (!is_silence(status)) self->owes_since_ = TimePoint::max();
      self->state_ = is_silence(status) ? State::unconnected : State::connected;
    });
  }
  [[nodiscard]] TimePoint owes_since() const { return owes_since_; }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  enum class State : std::uint8_t { unconnected, connected, asked };

  const std::string name_;
  const Connect connect_;
  const Ask ask_;
  ChannelPtr channel_;
  std::atomic<State> state_{State::unconnected};  ///< `asked` ends on a thread of gRPC's
  std::atomic<TimePoint> owes_since_{TimePoint::max()};
};

DoorCheck::DoorCheck(Connect main_server, Connect stop_lane)
    : doors_{std::make_shared<Door>("stop lane", std::move(stop_lane), &ask_lane),
             std::make_shared<Door>("main server", std::move(main_server), &ask_main)} {}

DoorCheck::~DoorCheck() = default;

void DoorCheck::ask() {
  for (const auto& door : doors_) door->ask();
}

std::vector<std::string> DoorCheck::silent_since(TimePoint when) const {
  std::vector<std::string> silent;
  for (const auto& door : doors_)
    if (door->owes_since() < when) silent.push_back(door->name());
  return silent;
}

}  // namespace axisd::server
