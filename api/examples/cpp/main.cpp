// Switches an axis on, moves it and prints where it is meanwhile; Ctrl-C halts it. The daemon: $AXISD_SERVER.
//   axisd-example AXIS [DISTANCE]
#include <axisd/v1/axis_service.grpc.pb.h>
#include <axisd/v1/command_service.grpc.pb.h>
#include <grpcpp/grpcpp.h>

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>

namespace v1 = axisd::v1;

namespace {

volatile std::sig_atomic_t interrupted = 0;

/// What the daemon says about a call that it refused: the standard trailer, with what to do about it.
std::string text_of(const grpc::Status& status) {
  v1::StatusDetails trailer;
  v1::ErrorDetail detail;
  trailer.ParseFromString(status.error_details());
  for (const auto& packed : trailer.details()) detail.ParseFromString(packed.value());
  return detail.remedy().empty() ? status.error_message() : detail.message() + "; " + detail.remedy();
}

void check(const grpc::Status& status) {
  if (!status.ok()) throw std::runtime_error(text_of(status));
}

/// Each motion has an id of its own: a call repeated with the same one never moves twice.
std::string new_request_id() {
  std::random_device random;
  return "example-" + std::to_string(random()) + "-" + std::to_string(random());
}

/// A connection of its own, not shared within the process.
std::shared_ptr<grpc::Channel> connect() {
  const char* server = std::getenv("AXISD_SERVER");
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return grpc::CreateCustomChannel(server != nullptr ? server : "localhost:7443",
                                   grpc::InsecureChannelCredentials(), arguments);
}

/// The call is OK also for a motion that failed: what became of it is in the command.
void expect_done(const v1::Command& command) {
  if (command.state() != v1::COMMAND_STATE_DONE)
    throw std::runtime_error(v1::CommandState_Name(command.state()) + ": " + command.cause().message());
}

class Example {
 public:
  explicit Example(std::string axis) : axis_(std::move(axis)) {}

  void enable() {
    v1::EnableRequest request;
    v1::EnableResponse response;
    fill(request, v1::WAIT_UNTIL_DONE);
    grpc::ClientContext context;
    check(axes_->Enable(&context, request, &response));
    expect_done(response.command());
  }

  /// Starts a move; it goes on whatever becomes of this program. Returns the command's id.
  std::string start(double distance) {
    v1::MoveRelativeRequest request;
    v1::MoveRelativeResponse response;
    fill(request, v1::WAIT_UNTIL_ACCEPTED);
    request.set_distance(distance);
    grpc::ClientContext context;
    check(axes_->MoveRelative(&context, request, &response));
    return response.command().id();
  }

  /// Prints the latest state ten times a second, until the axis no longer executes this command.
  void watch(const std::string& command) {
    v1::WatchAxesRequest request;
    request.add_axes(axis_);
    grpc::ClientContext context;
    const auto reader = axes_->WatchAxes(&context, request);
    v1::WatchAxesResponse batch;
    bool halted = false;
    while (reader->Read(&batch)) {
      const auto& state = batch.axes(0);
      if (state.command_id() != command) break;
      std::cout << v1::State_Name(state.state()) << " " << state.position() << " " << state.unit()
                << std::endl;
      if (interrupted != 0 && !halted) {
        halt();
        halted = true;
      }
    }
    context.TryCancel();
    reader->Finish();  // cancelled, by us
  }

  void expect_done_by_now(const std::string& command) {
    v1::GetCommandRequest request;
    v1::GetCommandResponse response;
    request.set_id(command);
    grpc::ClientContext context;
    check(commands_->GetCommand(&context, request, &response));
    expect_done(response.command());
  }

 private:
  template <class Request>
  void fill(Request& request, v1::WaitUntil until) const {
    request.set_axis(axis_);
    request.mutable_options()->set_request_id(new_request_id());
    request.mutable_options()->set_wait_until(until);
  }

  void halt() {
    v1::HaltRequest request;
    v1::HaltResponse response;
    fill(request, v1::WAIT_UNTIL_DONE);
    grpc::ClientContext context;
    check(stops_->Halt(&context, request, &response));
    expect_done(response.command());  // else it may still be moving
  }

  std::string axis_;
  std::shared_ptr<grpc::Channel> channel_ = connect();
  std::unique_ptr<v1::AxisService::Stub> axes_ = v1::AxisService::NewStub(channel_);
  std::unique_ptr<v1::CommandService::Stub> commands_ = v1::CommandService::NewStub(channel_);
  /// Its own connection: a halt must not queue behind what the other one transfers.
  std::unique_ptr<v1::AxisService::Stub> stops_ = v1::AxisService::NewStub(connect());
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::cerr << "usage: axisd-example AXIS [DISTANCE]\n";
    return 2;
  }
  std::signal(SIGINT, [](int) { interrupted = 1; });
  try {
    Example example(argv[1]);
    example.enable();
    const auto command = example.start(argc == 3 ? std::stod(argv[2]) : 10.0);
    example.watch(command);
    example.expect_done_by_now(command);
  } catch (const std::exception& error) {
    std::cerr << argv[1] << ": " << error.what() << "\n";
    return 1;
  }
  std::cout << argv[1] << ": done\n";
}
