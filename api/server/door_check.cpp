#include "api/server/door_check.hpp"

#include <grpcpp/create_channel_posix.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "axisd/v1/stop_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::server {
namespace {

using ChannelPtr = std::shared_ptr<grpc::Channel>;
using Answered = std::function<void(const grpc::Status&)>;
/// Keeps all of a question, by its context.
using QuestionPtr = std::shared_ptr<grpc::ClientContext>;

/// Beyond this a question is given up and asked anew, so that one lost answer is not the last.
constexpr auto patience = std::chrono::seconds(10);
/// Until a question that is cancelled has ended.
constexpr auto farewell = std::chrono::seconds(1);

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

/// `call` calls the method.
template <class Service, class Request, class Response>
QuestionPtr ask(const ChannelPtr& channel, Answered answered, auto call) {
  const auto question = std::make_shared<Question<Service, Request, Response>>(channel);
  call(*question->stub->async(), &question->context, &question->request, &question->response,
       std::move(answered));
  return {question, &question->context};
}

QuestionPtr ask_main(const ChannelPtr& channel, Answered answered) {
  return ask<v1::SystemService, v1::GetInfoRequest, v1::GetInfoResponse>(
      channel, std::move(answered), [](auto& service, auto... rest) { service.GetInfo(std::move(rest)...); });
}

QuestionPtr ask_lane(const ChannelPtr& channel, Answered answered) {
  return ask<v1::StopService, v1::GroupStopRequest, v1::GroupStopResponse>(
      channel, std::move(answered),
      [](auto& service, auto... rest) { service.GroupStop(std::move(rest)...); });
}

/// Nobody was there, or not in time.
bool is_silence(const grpc::Status& status) {
  const auto code = status.error_code();
  return code == grpc::StatusCode::UNAVAILABLE || code == grpc::StatusCode::DEADLINE_EXCEEDED ||
         code == grpc::StatusCode::CANCELLED || code == grpc::StatusCode::UNKNOWN;
}

}  // namespace

// Questions and channels end on the thread that asks: with the last channel gRPC joins its threads, and it
// does not survive that on one of them.
class DoorCheck::Door : public std::enable_shared_from_this<Door> {
 public:
  using Ask = QuestionPtr (*)(const ChannelPtr& channel, Answered answered);

  Door(std::string name, Connect connect, Ask ask)
      : name_(std::move(name)), connect_(std::move(connect)), ask_(ask) {}

  void ask() {
    const auto before = state();
    if (before == State::asked) return;
    if (owes_since_.load() == TimePoint::max()) owes_since_ = monotonic_now();
    question_.reset();
    if (before == State::unconnected) {
      auto socket = connect_();
      if (socket.get() < 0) return;  // out of descriptors: tried again with the next question
      channel_ = grpc::CreateInsecureChannelFromFd("axisd", socket.release());
    }
    become(State::asked);
    question_ = ask_(channel_, [self = shared_from_this()](const grpc::Status& status) {
      if (!is_silence(status)) self->owes_since_ = TimePoint::max();
      self->become(is_silence(status) ? State::unconnected : State::connected);
    });
  }
  /// Asks no more. A question that does not even end when it is cancelled is left to itself, with its
  /// channel.
  void end() {
    if (question_) question_->TryCancel();
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, farewell, [this] { return state_ != State::asked; })) {
      static auto& left = *new std::vector<std::pair<QuestionPtr, ChannelPtr>>;  // outlives the process's end
      left.emplace_back(std::move(question_), std::move(channel_));
    }
    question_.reset();
    channel_.reset();
  }
  [[nodiscard]] TimePoint owes_since() const { return owes_since_; }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  enum class State : std::uint8_t { unconnected, connected, asked };

  [[nodiscard]] State state() {
    const std::lock_guard lock(mutex_);
    return state_;
  }
  void become(State state) {
    const std::lock_guard lock(mutex_);
    state_ = state;
    changed_.notify_all();
  }

  const std::string name_;
  const Connect connect_;
  const Ask ask_;
  ChannelPtr channel_;
  QuestionPtr question_;
  std::mutex mutex_;
  std::condition_variable changed_;
  State state_ = State::unconnected;  ///< under mutex_; `asked` ends on a thread of gRPC's
  std::atomic<TimePoint> owes_since_{TimePoint::max()};
};

DoorCheck::DoorCheck(Connect main_server, Connect stop_lane,
                     std::vector<std::shared_ptr<transport::Knock>> knocks)
    : doors_{std::make_shared<Door>("stop lane", std::move(stop_lane), &ask_lane),
             std::make_shared<Door>("main server", std::move(main_server), &ask_main)},
      knocks_(std::move(knocks)) {}

DoorCheck::~DoorCheck() {
  for (const auto& door : doors_) door->end();
}

void DoorCheck::ask() {
  for (const auto& door : doors_) door->ask();
  for (const auto& each : knocks_) each->knock();
}

std::vector<std::string> DoorCheck::silent_since(TimePoint when) const {
  std::vector<std::string> silent;
  for (const auto& door : doors_)
    if (door->owes_since() < when) silent.push_back(door->name());
  for (const auto& each : knocks_)
    if (each->unanswered_since() < when) silent.push_back("new connections to " + each->name());
  return silent;
}

}  // namespace axisd::server
